// Requirements of a rig, and the search that follows from them.
#include <cmath>
#include <cstdint>
#include <string>

#include "spartan/rig/design/rig_designer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto requirements = spartan::parse_requirements(text, "requirements.yaml");
  if (!requirements) return 0;
  // What is accepted can be searched, and every figure of what is found is a number.
  constexpr std::size_t kFewEnough = 5000;
  if (requirements->wide.lists.combinations() > kFewEnough) return 0;
  if (requirements->narrow && requirements->narrow->lists.combinations() > kFewEnough) return 0;
  const spartan::RigDesign design = spartan::design_rig(*requirements);
  if (design.wide.feasible.size() > design.wide.combinations) __builtin_trap();
  for (const spartan::PairFigures& pair : design.wide.feasible) {
    if (!std::isfinite(pair.range_m) || !std::isfinite(pair.view_near_m) || !std::isfinite(pair.view_far_m))
      __builtin_trap();
  }
  return 0;
}
