# Finds the compiler and the libraries Swage stands on, or says in one sentence what to install.
# Result: target swage_foreign, versions in SWAGE_*_VERSION.

function(swage_missing what packages)
  message(FATAL_ERROR "Swage needs ${what}, which was not found. "
    "On Debian or Ubuntu: apt-get install ${packages}")
endfunction()

include(CheckLanguage)
check_language(Fortran)
if(NOT CMAKE_Fortran_COMPILER)
  swage_missing("a Fortran compiler" "gfortran")
endif()
check_language(C)
if(NOT CMAKE_C_COMPILER)
  swage_missing("a C compiler (CMake uses it to look for HDF5)" "gcc")
endif()
enable_language(Fortran)
enable_language(C)

# --- MPI
set(MPI_DETERMINE_LIBRARY_VERSION TRUE)
find_package(MPI QUIET COMPONENTS Fortran)
if(NOT MPI_Fortran_FOUND)
  swage_missing("MPI with its Fortran interface" "libopenmpi-dev openmpi-bin")
endif()
if(NOT MPI_Fortran_HAVE_F08_MODULE)
  message(FATAL_ERROR "Swage needs the Fortran module mpi_f08, which this MPI does not have. "
    "On Debian or Ubuntu: apt-get install libopenmpi-dev openmpi-bin")
endif()
string(REGEX REPLACE ",.*" "" SWAGE_MPI_VERSION "${MPI_Fortran_LIBRARY_VERSION_STRING}")
string(STRIP "${SWAGE_MPI_VERSION}" SWAGE_MPI_VERSION)
if(NOT SWAGE_MPI_VERSION)
  set(SWAGE_MPI_VERSION "standard ${MPI_Fortran_VERSION}")
endif()

# --- HDF5
set(HDF5_PREFER_PARALLEL ON)
find_package(HDF5 QUIET COMPONENTS Fortran)
if(NOT HDF5_FOUND)
  swage_missing("HDF5 with its Fortran interface" "libhdf5-openmpi-dev")
endif()
if(NOT HDF5_IS_PARALLEL)
  swage_missing("HDF5 built for MPI (a serial one was found)" "libhdf5-openmpi-dev")
endif()
set(SWAGE_HDF5_VERSION "${HDF5_VERSION}")

# --- MUMPS: no package files in Debian, so header and libraries are looked for by name.
find_path(MUMPS_INCLUDE_DIR dmumps_struc.h)
find_library(DMUMPS_LIBRARY dmumps)
find_library(SMUMPS_LIBRARY smumps)
if(NOT MUMPS_INCLUDE_DIR OR NOT DMUMPS_LIBRARY OR NOT SMUMPS_LIBRARY
    OR NOT EXISTS "${MUMPS_INCLUDE_DIR}/smumps_struc.h")
  swage_missing("MUMPS for MPI in double and single precision (dmumps, smumps)" "libmumps-dev")
endif()
set(SWAGE_MUMPS_VERSION "unknown version")
if(EXISTS "${MUMPS_INCLUDE_DIR}/dmumps_c.h")
  file(STRINGS "${MUMPS_INCLUDE_DIR}/dmumps_c.h" mumps_line REGEX "define MUMPS_VERSION ")
  string(REGEX REPLACE ".*\"(.*)\".*" "\\1" SWAGE_MUMPS_VERSION "${mumps_line}")
endif()

# --- METIS, whose integers must be those of default Fortran.
find_path(METIS_INCLUDE_DIR metis.h)
find_library(METIS_LIBRARY metis)
if(NOT METIS_INCLUDE_DIR OR NOT METIS_LIBRARY)
  swage_missing("METIS" "libmetis-dev")
endif()
file(STRINGS "${METIS_INCLUDE_DIR}/metis.h" metis_lines
  REGEX "^#define +(IDXTYPEWIDTH|METIS_VER_[A-Z]+) ")
string(REGEX REPLACE ".*IDXTYPEWIDTH +([0-9]+).*" "\\1" metis_width "${metis_lines}")
if(NOT metis_width EQUAL 32)
  message(FATAL_ERROR "Swage needs METIS with integers of 32 bits; ${METIS_INCLUDE_DIR}/metis.h "
    "says IDXTYPEWIDTH ${metis_width}. The libmetis-dev of Debian and Ubuntu has 32.")
endif()
string(REGEX REPLACE ".*VER_MAJOR +([0-9]+).*VER_MINOR +([0-9]+).*VER_SUBMINOR +([0-9]+).*"
  "\\1.\\2.\\3" SWAGE_METIS_VERSION "${metis_lines}")

# --- BLAS and LAPACK
find_package(BLAS QUIET)
if(NOT BLAS_FOUND)
  swage_missing("BLAS" "libopenblas-dev")
endif()
find_package(LAPACK QUIET)
if(NOT LAPACK_FOUND)
  swage_missing("LAPACK" "libopenblas-dev")
endif()
list(GET BLAS_LIBRARIES 0 blas_file)
get_filename_component(blas_file "${blas_file}" REALPATH)
get_filename_component(SWAGE_BLAS_VERSION "${blas_file}" NAME)
if(SWAGE_BLAS_VERSION MATCHES "openblas.*r([0-9.]+[0-9])")
  set(SWAGE_BLAS_VERSION "OpenBLAS ${CMAKE_MATCH_1}")
endif()

add_library(swage_foreign INTERFACE)
# CMake keeps -I/usr/include for Fortran; gfortran does not look there by itself.
target_include_directories(swage_foreign INTERFACE
  "$<BUILD_INTERFACE:${MUMPS_INCLUDE_DIR}>" "$<BUILD_INTERFACE:${HDF5_Fortran_INCLUDE_DIRS}>")
target_link_libraries(swage_foreign INTERFACE ${DMUMPS_LIBRARY} ${SMUMPS_LIBRARY}
  ${METIS_LIBRARY} ${HDF5_Fortran_LIBRARIES} LAPACK::LAPACK BLAS::BLAS MPI::MPI_Fortran)
message(STATUS "MPI ${SWAGE_MPI_VERSION}, HDF5 ${SWAGE_HDF5_VERSION}, MUMPS "
  "${SWAGE_MUMPS_VERSION}, METIS ${SWAGE_METIS_VERSION}, BLAS ${SWAGE_BLAS_VERSION}")
