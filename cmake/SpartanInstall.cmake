# `cmake --install build/release --prefix X`: libraries, public headers, program (src/program installs it), configuration,
# and the package that `find_package(spartan)` reads. Tests and the test-support library stay out.
include(CMakePackageConfigHelpers)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/spartan)

get_property(modules GLOBAL PROPERTY SPARTAN_MODULES)
list(REMOVE_ITEM modules testing)
list(TRANSFORM modules PREPEND spartan_)
install(TARGETS ${modules} spartan EXPORT spartanTargets COMPONENT development)
install(EXPORT spartanTargets NAMESPACE spartan:: DESTINATION ${package_folder} COMPONENT development)

install(DIRECTORY src/spartan DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
  FILES_MATCHING PATTERN "*.h" PATTERN "internal" EXCLUDE PATTERN "testing" EXCLUDE PATTERN "numerics" EXCLUDE PATTERN "figures" EXCLUDE)
if(EXISTS ${PROJECT_SOURCE_DIR}/config)
  install(DIRECTORY config DESTINATION ${CMAKE_INSTALL_DATADIR}/spartan COMPONENT program)
endif()

# The components of the package: for each module what it uses, and the packages of the libraries that it links.
set(components)
foreach(module IN LISTS modules)
  string(REPLACE "spartan_" "" module ${module})
  get_property(uses GLOBAL PROPERTY SPARTAN_USES_${module})
  get_property(libraries GLOBAL PROPERTY SPARTAN_LIBRARIES_${module})
  set(packages)
  foreach(library IN LISTS libraries)
    if(NOT DEFINED SPARTAN_PACKAGE_OF_${library})
      message(FATAL_ERROR "module ${module} links ${library}, whose package SpartanDependencies.cmake does not name")
    endif()
    list(APPEND packages "${SPARTAN_PACKAGE_OF_${library}}")
  endforeach()
  list(REMOVE_DUPLICATES packages)
  string(APPEND components "set(spartan_uses_${module} \"${uses}\")\nset(spartan_packages_${module} \"${packages}\")\n")
  list(APPEND component_names ${module})
endforeach()

configure_package_config_file(cmake/spartanConfig.cmake.in spartanConfig.cmake INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(spartanConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/spartanConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/spartanConfigVersion.cmake
  DESTINATION ${package_folder} COMPONENT development)
