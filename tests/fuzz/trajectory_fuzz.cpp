// Trajectories: TUM, KITTI and EuRoC files.
#include <cstdint>
#include <string>

#include "spartan/core/trajectory.h"

namespace {

// An accepted trajectory must have finite poses and increasing stamps.
void check(const spartan::Result<spartan::Trajectory>& trajectory) {
  if (!trajectory) return;
  for (std::size_t i = 0; i < trajectory->size(); ++i) {
    if (!(*trajectory)[i].pose.all_finite()) __builtin_trap();
    if (i > 0 && (*trajectory)[i].stamp <= (*trajectory)[i - 1].stamp) __builtin_trap();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  check(spartan::parse_tum(text, "input"));
  check(spartan::parse_kitti(text, "input", {}));
  check(spartan::parse_euroc(text, "input"));
  return 0;
}
