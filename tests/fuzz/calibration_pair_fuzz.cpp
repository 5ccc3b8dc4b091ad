// Calibrations with a file for each eye: ROS, mrcal, Ames, JPL. The input is both, with a line "=====" between them.
// What is accepted is sound, and can be written and read again.
#include <cstdint>
#include <string>
#include <string_view>

#include "input_file.h"
#include "spartan/rig/rig_differences.h"
#include "spartan/rig/rig_files.h"
#include "spartan/rig/rig_writing.h"

namespace {

using spartan::testing::InputFile;
using Read = spartan::Result<spartan::ReadRig>;

constexpr spartan::ImageSize kSize{640, 480};

InputFile file_of(std::string_view text) {
  return InputFile(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
}

template <class Reader>
void check(const InputFile& left, const InputFile& right, Reader read) {
  const Read first = read(left.path(), right.path());
  if (!first) return;
  if (!first->rig.find_faults().empty()) __builtin_trap();
  const auto files = spartan::to_calibration_files(first->rig, first->format, "pair.x");
  if (!files) return;
  const InputFile left_again = file_of((*files)[0].content), right_again = file_of((*files)[1].content);
  // Numbers near the ends of what a double holds may become too large on the way; nothing else may be refused.
  const Read second = read(left_again.path(), right_again.path());
  if (second && second->rig.cameras.size() != first->rig.cameras.size()) __builtin_trap();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const std::string_view between = "\n=====\n";
  const std::size_t at = text.find(between);
  const InputFile left = file_of(text.substr(0, at));
  const InputFile right = file_of(at == std::string_view::npos ? text : text.substr(at + between.size()));
  check(left, right, [](const auto& l, const auto& r) { return spartan::read_ros_calib(l, r); });
  check(left, right, [](const auto& l, const auto& r) { return spartan::read_mrcal_calib(l, r); });
  check(left, right, [](const auto& l, const auto& r) { return spartan::read_tsai_calib(l, r, kSize); });
  check(left, right, [](const auto& l, const auto& r) { return spartan::read_cahvor_calib(l, r, kSize); });
  return 0;
}
