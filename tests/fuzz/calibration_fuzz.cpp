// Calibration formats with one file (KITTI, KITTI raw, EuRoC, Kalibr, OpenCV, ZED) and format detection.
// Accepted calibrations must be valid and round-trip.
#include <cstdint>
#include <string>

#include "input_file.h"
#include "survives_writing.h"

namespace {

using Format = spartan::CalibrationFormat;

void check(const spartan::Result<spartan::Rig>& rig, Format format) {
  if (rig) spartan::testing::check_survives_writing(*rig, format);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const spartan::testing::InputFile input(data, size);
  check(spartan::read_kitti_calib(input.path(), {640, 480}), Format::kitti);
  check(spartan::read_kitti_raw_calib(input.path()), Format::kitti_raw);
  check(spartan::read_opencv_calib(input.path(), "", {640, 480}), Format::opencv);
  spartan::testing::check_survives_writing(spartan::read_kalibr_calib(input.path()));
  spartan::testing::check_survives_writing(spartan::read_zed_calib(input.path(), {1280, 720}));

  const std::string text(reinterpret_cast<const char*>(data), size);
  (void)spartan::detect_calibration_format("x.txt", text);
  if (text.find("T_BS") == std::string::npos) return 0;
  // Two cameras at the same position are rejected, so the right one is moved.
  static const spartan::testing::TemporaryFolder folder;
  std::string right = text;
  const std::size_t at = right.find("0.055");
  if (at != std::string::npos) right.replace(at, 5, "-0.05");
  folder.write("cam0/sensor.yaml", text);
  folder.write("cam1/sensor.yaml", right);
  check(spartan::read_euroc_calib(folder.path()), Format::euroc);
  return 0;
}
