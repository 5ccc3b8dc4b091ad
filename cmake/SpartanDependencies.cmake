# Every third-party package the project links, found once. `setup` installs them.
# The libraries' own list is handed on to those who link an installed Spartan (SpartanInstall.cmake).
set(SPARTAN_PACKAGES
  "Eigen3 3.4 NO_MODULE"
  "OpenCV 4.6 COMPONENTS core imgproc imgcodecs"
  "libjpeg-turbo CONFIG"
  "hwy CONFIG"
  "TBB"
  "tl-expected"
  "yaml-cpp"
  "nlohmann_json"
  "fmt"
  "spdlog"
  "SQLite3 3.40"
  "Threads")
foreach(package IN LISTS SPARTAN_PACKAGES)
  separate_arguments(arguments UNIX_COMMAND "${package}")
  find_package(${arguments} REQUIRED)
endforeach()
set(SPARTAN_OPENCV opencv_core opencv_imgproc opencv_imgcodecs)


# Optional; what needs them says so when they are absent.
set(SPARTAN_OPTIONAL_PACKAGES "embree 3.13" "GDAL 3.6")  # the simulator; GeoTIFF
foreach(package IN LISTS SPARTAN_OPTIONAL_PACKAGES)
  separate_arguments(arguments UNIX_COMMAND "${package}")
  find_package(${arguments} QUIET)
  list(GET arguments 0 name)
  if(${name}_FOUND)
    list(APPEND SPARTAN_PACKAGES "${package}")
  endif()
endforeach()
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
