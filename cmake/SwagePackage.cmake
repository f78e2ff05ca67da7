# What `cmake --install` leaves: program, library, modules, header, and files by which other builds
# find them: find_package(swage) and pkg-config.
include(CMakePackageConfigHelpers)

set(SWAGE_INSTALL_CMAKEDIR "${CMAKE_INSTALL_LIBDIR}/cmake/swage")
set_target_properties(swage_library PROPERTIES EXPORT_NAME swage)
set_target_properties(swage_foreign PROPERTIES EXPORT_NAME foreign)
install(TARGETS swage_library swage_foreign EXPORT swageTargets
  ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}")
install(EXPORT swageTargets NAMESPACE swage:: DESTINATION "${SWAGE_INSTALL_CMAKEDIR}")
install(DIRECTORY "${CMAKE_BINARY_DIR}/modules/" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/swage"
  FILES_MATCHING PATTERN "*.mod")
install(FILES "${CMAKE_CURRENT_SOURCE_DIR}/modules/simulation/swage.h"
  DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/swage")

configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/swageConfig.cmake.in"
  "${CMAKE_BINARY_DIR}/generated/swageConfig.cmake"
  INSTALL_DESTINATION "${SWAGE_INSTALL_CMAKEDIR}"
  PATH_VARS CMAKE_INSTALL_BINDIR
  NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file("${CMAKE_BINARY_DIR}/generated/swageConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES
  "${CMAKE_BINARY_DIR}/generated/swageConfig.cmake"
  "${CMAKE_BINARY_DIR}/generated/swageConfigVersion.cmake"
  DESTINATION "${SWAGE_INSTALL_CMAKEDIR}")

# --- pkg-config: libraries by their paths, those of the compiler for a C program that links.
set(SWAGE_PC_LIBS "")
set(libraries ${DMUMPS_LIBRARY} ${SMUMPS_LIBRARY} ${METIS_LIBRARY} ${HDF5_Fortran_LIBRARIES}
  ${LAPACK_LIBRARIES} ${BLAS_LIBRARIES} ${MPI_Fortran_LIBRARIES})
foreach(library IN LISTS CMAKE_Fortran_IMPLICIT_LINK_LIBRARIES)
  if(library MATCHES "^(gfortran|quadmath|m)$")
    list(APPEND libraries ${library})
  endif()
endforeach()
list(REMOVE_DUPLICATES libraries)
set(folders "")
foreach(library IN LISTS libraries)
  if(IS_ABSOLUTE "${library}")
    string(APPEND SWAGE_PC_LIBS " ${library}")
    get_filename_component(folder "${library}" DIRECTORY)
    list(APPEND folders "${folder}")
  elseif(library MATCHES "^-")
    string(APPEND SWAGE_PC_LIBS " ${library}")
  else()
    string(APPEND SWAGE_PC_LIBS " -l${library}")
  endif()
endforeach()
list(REMOVE_DUPLICATES folders)
foreach(folder IN LISTS folders)
  if(NOT folder IN_LIST CMAKE_Fortran_IMPLICIT_LINK_DIRECTORIES)
    string(APPEND SWAGE_PC_LIBS " -Wl,-rpath,${folder}")
  endif()
endforeach()
string(STRIP "${SWAGE_PC_LIBS}" SWAGE_PC_LIBS)
file(RELATIVE_PATH SWAGE_PC_PREFIX "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
configure_file("${CMAKE_CURRENT_LIST_DIR}/swage.pc.in" "${CMAKE_BINARY_DIR}/generated/swage.pc"
  @ONLY)
install(FILES "${CMAKE_BINARY_DIR}/generated/swage.pc"
  DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig")
