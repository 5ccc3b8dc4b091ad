# Every third-party package the project links, found once. `setup` installs them.
# The libraries' own list is handed on to those who link an installed Spartan (SpartanInstall.cmake).
set(SPARTAN_PACKAGES
  "Eigen3 3.4 NO_MODULE"
  "OpenCV 4.6 COMPONENTS core imgproc imgcodecs"
  "Ceres 2.1"
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

find_package(CLI11 REQUIRED)  # the program only
