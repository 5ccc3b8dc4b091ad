// Calibrations of other projects: KITTI, KITTI raw, EuRoC, OpenCV.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "input_file.h"
#include "spartan/rig/rig_files.h"
#include "spartan/testing/temporary_folder.h"

namespace {

void check(const spartan::Result<spartan::Rig>& rig) {
  if (rig && !rig->find_faults().empty()) __builtin_trap();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const spartan::testing::InputFile input(data, size);
  check(spartan::read_kitti_calib(input.path(), {640, 480}));
  check(spartan::read_kitti_raw_calib(input.path()));
  check(spartan::read_opencv_calib(input.path(), "", {640, 480}));

  static const spartan::testing::TemporaryFolder folder;
  const std::string text(reinterpret_cast<const char*>(data), size);
  folder.write("cam0/sensor.yaml", text);
  folder.write("cam1/sensor.yaml", text);
  check(spartan::read_euroc_calib(folder.path()));
  return 0;
}
