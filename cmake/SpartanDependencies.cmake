# Every third-party package the project links, found once. `setup` installs them.

# spartan_package("PACKAGE AND ARGUMENTS OF FIND_PACKAGE" [OPTIONAL] LIBRARIES targets…)
# An installed Spartan looks for the package of each library that the wanted modules link (SpartanInstall.cmake).
# A macro: the targets and variables of the package must be seen by the caller.
macro(spartan_package package)
  cmake_parse_arguments(A "OPTIONAL" "" "LIBRARIES" ${ARGN})
  separate_arguments(arguments UNIX_COMMAND "${package}")
  if(A_OPTIONAL)
    find_package(${arguments} QUIET)
  else()
    find_package(${arguments} REQUIRED)
  endif()
  foreach(library IN LISTS A_LIBRARIES)
    set(SPARTAN_PACKAGE_OF_${library} "${package}")
  endforeach()
endmacro()

set(SPARTAN_OPENCV opencv_core opencv_imgproc)
spartan_package("Eigen3 3.4 NO_MODULE" LIBRARIES Eigen3::Eigen)
spartan_package("OpenCV 4.6 COMPONENTS core imgproc" LIBRARIES ${SPARTAN_OPENCV})
spartan_package("OpenCV 4.6 COMPONENTS features2d" LIBRARIES opencv_features2d)  # detectors other than SURF and Harris
spartan_package("OpenCV 4.6 COMPONENTS imgcodecs" LIBRARIES opencv_imgcodecs)  # the simulator's compression
spartan_package("PNG" LIBRARIES PNG::PNG)
spartan_package("libjpeg-turbo CONFIG" LIBRARIES libjpeg-turbo::turbojpeg)
spartan_package("hwy CONFIG" LIBRARIES hwy::hwy)
spartan_package("TBB" LIBRARIES TBB::tbb)
spartan_package("tl-expected" LIBRARIES tl::expected)
spartan_package("yaml-cpp" LIBRARIES yaml-cpp)
spartan_package("nlohmann_json" LIBRARIES nlohmann_json::nlohmann_json)
spartan_package("fmt" LIBRARIES fmt::fmt)
spartan_package("spdlog" LIBRARIES spdlog::spdlog)
spartan_package("SQLite3 3.40" LIBRARIES SQLite::SQLite3)

# Optional; what needs them says so when they are absent.
spartan_package("embree 3.13" OPTIONAL LIBRARIES embree)  # the simulator
spartan_package("GDAL 3.6" OPTIONAL LIBRARIES GDAL::GDAL)  # GeoTIFF
if(GDAL_FOUND)
  set(SPARTAN_GDAL GDAL::GDAL)
endif()

find_package(CLI11 REQUIRED)  # the program only

# Oracle of the camera models in tests; has no CMake package.
find_library(SPARTAN_MRCAL_LIBRARY mrcal)
find_path(SPARTAN_MRCAL_INCLUDE mrcal/mrcal.h)
if(SPARTAN_MRCAL_LIBRARY AND SPARTAN_MRCAL_INCLUDE)
  add_library(spartan_mrcal INTERFACE)
  target_link_libraries(spartan_mrcal INTERFACE ${SPARTAN_MRCAL_LIBRARY})
  target_include_directories(spartan_mrcal SYSTEM INTERFACE ${SPARTAN_MRCAL_INCLUDE})
  target_compile_definitions(spartan_mrcal INTERFACE SPARTAN_HAS_MRCAL)
  set(SPARTAN_MRCAL spartan_mrcal)
endif()
