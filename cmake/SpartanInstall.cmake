# `cmake --install build/release --prefix X`: libraries, public headers, program (src/program installs it), configuration,
# and the package that `find_package(spartan)` reads. Tests and the test-support library stay out.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/spartan)

get_property(modules GLOBAL PROPERTY SPARTAN_MODULES)
list(REMOVE_ITEM modules testing)
list(TRANSFORM modules PREPEND spartan_)
install(TARGETS ${modules} spartan EXPORT spartanTargets)
install(EXPORT spartanTargets NAMESPACE spartan:: DESTINATION ${package_folder})

install(DIRECTORY src/spartan DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  FILES_MATCHING PATTERN "*.h" PATTERN "internal" EXCLUDE PATTERN "testing" EXCLUDE)
if(EXISTS ${PROJECT_SOURCE_DIR}/config)
  install(DIRECTORY config DESTINATION ${CMAKE_INSTALL_DATADIR}/spartan)
endif()

configure_package_config_file(cmake/spartanConfig.cmake.in spartanConfig.cmake INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(spartanConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/spartanConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/spartanConfigVersion.cmake
  DESTINATION ${package_folder})
