// Calibration formats with one file per camera: ROS, mrcal, Ames, JPL. The input contains both files, separated by a
// line
// "=====". Accepted calibrations must be valid and round-trip.
#include <cstdint>
#include <string>
#include <string_view>

#include "input_file.h"
#include "survives_writing.h"

namespace {

using spartan::testing::check_survives_writing;
using spartan::testing::InputFile;

constexpr spartan::ImageSize kSize{640, 480};

InputFile file_of(std::string_view text) {
  return InputFile(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::string_view separator = "\n=====\n";
  const std::size_t at = text.find(separator);
  const InputFile left = file_of(text.substr(0, at));
  const InputFile right = file_of(at == std::string_view::npos ? text : text.substr(at + separator.size()));
  const std::string l = left.path(), r = right.path();
  check_survives_writing(spartan::read_ros_calib(l, r));
  check_survives_writing(spartan::read_mrcal_calib(l, r));
  check_survives_writing(spartan::read_tsai_calib(l, r, kSize));
  check_survives_writing(spartan::read_cahvor_calib(l, r, kSize));
  return 0;
}
