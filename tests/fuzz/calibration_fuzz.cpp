// Calibrations of other projects in one file: KITTI, KITTI raw, EuRoC, Kalibr, OpenCV; and which one a file is.
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "input_file.h"
#include "spartan/rig/rig_files.h"
#include "spartan/testing/temporary_folder.h"

namespace {

void check(const spartan::Rig& rig) {
  if (!rig.find_faults().empty()) __builtin_trap();
}
void check(const spartan::Result<spartan::Rig>& rig) {
  if (rig) check(*rig);
}
void check(const spartan::Result<spartan::ReadRig>& read) {
  if (read) check(read->rig);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const spartan::testing::InputFile input(data, size);
  check(spartan::read_kitti_calib(input.path(), {640, 480}));
  check(spartan::read_kitti_raw_calib(input.path()));
  check(spartan::read_opencv_calib(input.path(), "", {640, 480}));
  check(spartan::read_kalibr_calib(input.path()));

  const std::string text(reinterpret_cast<const char*>(data), size);
  (void)spartan::guess_format("x.txt", text);
  if (text.find("T_BS") == std::string::npos) return 0;
  static const spartan::testing::TemporaryFolder folder;
  folder.write("cam0/sensor.yaml", text);
  folder.write("cam1/sensor.yaml", text);
  check(spartan::read_euroc_calib(folder.path()));
  return 0;
}
