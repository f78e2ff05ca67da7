# Compiler flags of Swage's own code: target swage_flags. Foreign code is not held to them.
add_library(swage_flags INTERFACE)

# No source asks for the preprocessor, so Ninja need not run it to find the modules used.
set(CMAKE_Fortran_PREPROCESS OFF)

if(CMAKE_Fortran_COMPILER_ID STREQUAL "GNU")
  set(SWAGE_COMMON_FLAGS -std=f2018 -Wall -Wextra -Wimplicit-interface -Werror)
  set(SWAGE_RELEASE_FLAGS -O3)
  set(SWAGE_DEBUG_FLAGS -O0 -g -fbacktrace -fcheck=all -ffpe-trap=invalid,zero,overflow
    -finit-real=snan)
  set(SWAGE_FOREIGN_HEADER_FLAGS "-std=gnu;-Wno-error")
  # CMake's own choices give way to the lists above.
  set(CMAKE_Fortran_FLAGS_RELEASE "")
  set(CMAKE_Fortran_FLAGS_DEBUG "")
else()
  message(WARNING "Swage is tried with gfortran only; ${CMAKE_Fortran_COMPILER_ID} Fortran is "
    "used with its default flags")
  set(SWAGE_COMMON_FLAGS "")
  set(SWAGE_RELEASE_FLAGS "")
  set(SWAGE_DEBUG_FLAGS "")
  set(SWAGE_FOREIGN_HEADER_FLAGS "")
endif()
if(SWAGE_PROCESSOR)
  # Products and sums stay apart: all processors compute the same numbers, and a * b - a * b is 0.
  list(APPEND SWAGE_RELEASE_FLAGS "-march=${SWAGE_PROCESSOR}" -ffp-contract=off)
endif()

target_compile_options(swage_flags INTERFACE
  ${SWAGE_COMMON_FLAGS}
  "$<$<CONFIG:Release>:${SWAGE_RELEASE_FLAGS}>"
  "$<$<CONFIG:Debug>:${SWAGE_DEBUG_FLAGS}>")
