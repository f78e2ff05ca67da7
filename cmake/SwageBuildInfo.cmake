# Writes the module swage_build_info, which `swage --version` prints.
string(TOUPPER "${CMAKE_BUILD_TYPE}" build_type)
string(TOLOWER "${CMAKE_BUILD_TYPE}" SWAGE_BUILD_TYPE)
set(flags "${CMAKE_Fortran_FLAGS} ${SWAGE_COMMON_FLAGS} ${SWAGE_${build_type}_FLAGS}")
string(REPLACE ";" " " flags "${flags}")
string(STRIP "${flags}" flags)

# Fortran lines are short: the text becomes several literals, joined.
set(SWAGE_BUILD_FLAGS "")
while(NOT flags STREQUAL "")
  string(SUBSTRING "${flags}" 0 72 piece)
  string(LENGTH "${piece}" length)
  string(SUBSTRING "${flags}" ${length} -1 flags)
  string(REPLACE "'" "''" piece "${piece}")
  if(SWAGE_BUILD_FLAGS STREQUAL "")
    set(SWAGE_BUILD_FLAGS "'${piece}'")
  else()
    string(APPEND SWAGE_BUILD_FLAGS " &\n    // '${piece}'")
  endif()
endwhile()

set(SWAGE_BUILD_INFO_SOURCE "${CMAKE_BINARY_DIR}/generated/swage_build_info.f90")
configure_file("${CMAKE_CURRENT_SOURCE_DIR}/modules/base/swage_build_info.f90.in"
  "${SWAGE_BUILD_INFO_SOURCE}" @ONLY)
