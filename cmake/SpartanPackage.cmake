# `make package`: Debian packages by CPack, one a component. The program alone on a rover's computer needs no camera
# library and no header:
#   spartan          the program, scenarios and rigs, the man page, completions, the unit for systemd
#   spartan-cameras  plugins of cameras and videos: Aravis, GStreamer, FFmpeg
#   libspartan-dev   libraries, headers, the CMake package and its example
# What the binaries link is found by dpkg-shlibdeps.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME spartan)
set(CPACK_PACKAGE_VENDOR "The Spartan developers")
set(CPACK_PACKAGE_CONTACT "The Spartan developers <root@localhost>" CACHE STRING "Maintainer of the packages, with an address")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${CMAKE_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/SpartanPackageFiles.cmake)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL program cameras development)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME spartan)
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "Visual odometry, dense stereo, terrain maps, map merging, and localization that
fuses optional sensors, on recordings and live cameras, with one or two CPU
cores. `spartan demo` simulates a drive on Mars and processes it.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS spartan-cameras)

set(CPACK_DEBIAN_CAMERAS_PACKAGE_NAME spartan-cameras)
set(CPACK_DEBIAN_CAMERAS_DESCRIPTION "Plugins of the program spartan: GenICam cameras over GigE Vision and USB3
Vision (Aravis), anything that a pipeline of GStreamer delivers, video files.")
set(CPACK_DEBIAN_CAMERAS_PACKAGE_DEPENDS "spartan (= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")
set(CPACK_DEBIAN_CAMERAS_PACKAGE_RECOMMENDS "gstreamer1.0-plugins-base, gstreamer1.0-plugins-good")

# Those that find_package(spartan) looks for; its static libraries leave what they link to the user's program.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libspartan-dev)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "The library for C++: static libraries, headers, and the CMake package
(find_package(spartan)).")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(used libeigen3-dev libopencv-dev libpng-dev libturbojpeg0-dev libhwy-dev libtbb-dev libexpected-dev libyaml-cpp-dev
  nlohmann-json3-dev libfmt-dev libspdlog-dev libsqlite3-dev)
if(embree_FOUND)
  list(APPEND used libembree-dev)
endif()
if(GDAL_FOUND)
  list(APPEND used libgdal-dev)
endif()
string(JOIN ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS ${used})
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS "cmake, g++")

# Debian's copyright and changelog of each package.
find_program(SPARTAN_GZIP gzip REQUIRED)
set(changelog ${CMAKE_CURRENT_BINARY_DIR}/changelog.gz)
execute_process(COMMAND ${SPARTAN_GZIP} -9nc ${PROJECT_SOURCE_DIR}/CHANGELOG.md OUTPUT_FILE ${changelog} COMMAND_ERROR_IS_FATAL ANY)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/CHANGELOG.md)
foreach(component IN LISTS CPACK_COMPONENTS_ALL)
  string(TOUPPER ${component} upper)
  set(folder ${CMAKE_INSTALL_DATADIR}/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
  install(FILES ${CMAKE_CURRENT_LIST_DIR}/debian_copyright DESTINATION ${folder} RENAME copyright COMPONENT ${component})
  install(FILES ${changelog} DESTINATION ${folder} COMPONENT ${component})
endforeach()
include(CPack)
