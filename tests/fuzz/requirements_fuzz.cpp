// Requirements of a rig design and the resulting search.
#include <cmath>
#include <cstdint>
#include <string>

#include "spartan/rig_design/rig_designer.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  const auto requirements = spartan::parse_requirements(text, "requirements.yaml");
  if (!requirements) return 0;
  // A design search with accepted requirements must give finite values.
  constexpr std::size_t kMaxCombinations = 5000;
  for (const spartan::PairRequirements& pair : requirements->pairs) {
    if (pair.lists.combinations() > kMaxCombinations) return 0;
  }
  const spartan::RigDesign design = spartan::design_rig(*requirements);
  if (design.pairs[0].feasible.size() > design.pairs[0].combinations) __builtin_trap();
  for (const spartan::PairMetrics& pair : design.pairs[0].feasible) {
    if (!std::isfinite(pair.range_m) || !std::isfinite(pair.view_near_m) || !std::isfinite(pair.view_far_m))
      __builtin_trap();
  }
  return 0;
}
