#include "spartan/numerics/simd_target.h"

#include <hwy/highway.h>
#include <hwy/targets.h>

#include <cstdint>

namespace spartan {
namespace {

// In Highway a lower bit is a better target: this mask keeps a target and all that are worse.
std::int64_t at_most(std::int64_t best) {
  return ~(best - 1);
}

std::int64_t allowed(SimdTarget target) {
  if (target == SimdTarget::sse4) return at_most(HWY_SSE4);
  if (target == SimdTarget::avx2) return at_most(HWY_AVX2);
  return ~std::int64_t{0};
}

}  // namespace

std::size_t simd_target_index(SimdTarget target) {
  hwy::ChosenTarget chosen;
  const std::int64_t mask = hwy::SupportedTargets() & allowed(target);
  chosen.Update(mask != 0 ? mask : hwy::SupportedTargets());
  return chosen.GetIndex();
}

std::vector<SimdTarget> available_simd_targets() {
  std::vector<SimdTarget> available;
  const std::int64_t targets = hwy::SupportedTargets();
  if ((targets & HWY_SSE4) != 0) available.push_back(SimdTarget::sse4);
  if ((targets & HWY_AVX2) != 0) available.push_back(SimdTarget::avx2);
  if ((targets & (HWY_AVX3 | HWY_AVX3_DL)) != 0) available.push_back(SimdTarget::avx3);
  return available;
}

}  // namespace spartan
