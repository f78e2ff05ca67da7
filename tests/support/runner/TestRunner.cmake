# Stand-in for pFUnit where it is not installed: the libraries `funit` and `pfunit` and
#   add_pfunit_ctest(name TEST_SOURCES x.pf ... [OTHER_SOURCES y.f90 ...] [LINK_LIBRARIES lib ...]
#                    [MAX_PES n])
find_package(Python3 3.9 QUIET COMPONENTS Interpreter)
if(NOT Python3_Interpreter_FOUND)
  message(FATAL_ERROR "The unit tests need Python 3.9 or later, which was not found. "
    "On Debian or Ubuntu: apt-get install python3, or configure with -DSWAGE_TESTS=OFF")
endif()

set(SWAGE_PF_PROCESS "${CMAKE_CURRENT_LIST_DIR}/pf_process")
add_library(swage_test_runner STATIC
  "${CMAKE_CURRENT_LIST_DIR}/swage_test_failures.f90"
  "${CMAKE_CURRENT_LIST_DIR}/swage_test_value.f90"
  "${CMAKE_CURRENT_LIST_DIR}/swage_test_assert.f90"
  "${CMAKE_CURRENT_LIST_DIR}/swage_test_runner.f90"
  "${CMAKE_CURRENT_LIST_DIR}/funit.f90"
  "${CMAKE_CURRENT_LIST_DIR}/pfunit.f90")
set_target_properties(swage_test_runner PROPERTIES
  Fortran_MODULE_DIRECTORY "${CMAKE_BINARY_DIR}/modules_test_runner")
target_include_directories(swage_test_runner PUBLIC "${CMAKE_BINARY_DIR}/modules_test_runner")
target_link_libraries(swage_test_runner PUBLIC MPI::MPI_Fortran PRIVATE swage_flags)

function(add_pfunit_ctest name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "MAX_PES" "TEST_SOURCES;OTHER_SOURCES;LINK_LIBRARIES")
  if(arg_UNPARSED_ARGUMENTS OR NOT arg_TEST_SOURCES)
    message(FATAL_ERROR "add_pfunit_ctest(${name}): TEST_SOURCES is missing or arguments are not "
      "understood: ${arg_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT arg_MAX_PES)
    set(arg_MAX_PES 1)
  endif()

  set(folder "${CMAKE_CURRENT_BINARY_DIR}/${name}.generated")
  file(MAKE_DIRECTORY "${folder}")
  set(generated "")
  set(test_files "")
  foreach(source IN LISTS arg_TEST_SOURCES)
    get_filename_component(source "${source}" ABSOLUTE)
    get_filename_component(stem "${source}" NAME_WE)
    add_custom_command(OUTPUT "${folder}/${stem}.f90"
      COMMAND Python3::Interpreter "${SWAGE_PF_PROCESS}" "${source}" "${folder}/${stem}.f90"
      DEPENDS "${source}" "${SWAGE_PF_PROCESS}" VERBATIM)
    list(APPEND generated "${folder}/${stem}.f90")
    list(APPEND test_files "${source}")
  endforeach()
  add_custom_command(OUTPUT "${folder}/run_tests.f90"
    COMMAND Python3::Interpreter "${SWAGE_PF_PROCESS}" --driver "${folder}/run_tests.f90"
      ${test_files}
    DEPENDS "${SWAGE_PF_PROCESS}" VERBATIM)

  add_executable(${name} ${generated} "${folder}/run_tests.f90" ${arg_OTHER_SOURCES})
  set_target_properties(${name} PROPERTIES Fortran_MODULE_DIRECTORY "${folder}/modules")
  target_link_libraries(${name} PRIVATE ${arg_LINK_LIBRARIES} swage_test_runner swage_flags)
  add_test(NAME ${name} COMMAND ${MPIEXEC_EXECUTABLE} --oversubscribe
    ${MPIEXEC_NUMPROC_FLAG} ${arg_MAX_PES} ${MPIEXEC_PREFLAGS} $<TARGET_FILE:${name}>)
  # Jobs that start and end together must not share the session folder of Open MPI: one may remove
  # it while the other is about to use it.
  set_tests_properties(${name} PROPERTIES ENVIRONMENT "TMPDIR=${folder}")
endfunction()

# The runner must also fail when it should.
add_test(NAME check_runner COMMAND Python3::Interpreter "${CMAKE_CURRENT_LIST_DIR}/check_runner"
  "${MPI_Fortran_COMPILER}" "${CMAKE_BINARY_DIR}" "${MPIEXEC_EXECUTABLE}" --oversubscribe
  ${MPIEXEC_PREFLAGS} ${MPIEXEC_NUMPROC_FLAG})
file(MAKE_DIRECTORY "${CMAKE_CURRENT_BINARY_DIR}/check_runner")
set_tests_properties(check_runner PROPERTIES LABELS unit TIMEOUT 300
  ENVIRONMENT "TMPDIR=${CMAKE_CURRENT_BINARY_DIR}/check_runner")
