// Sub-pixel interpolation of the disparity from the aggregated costs around the minimum.
#pragma once

#include <algorithm>
#include <cstdint>

namespace spartan::internal {

/// Offset in (−½, ½) of the minimum from the costs b at it and a, c at both neighbours. Hamming distances rise about
/// linearly on both sides of the minimum, so two lines of equal and opposite slope are intersected ("equiangular" fit:
/// Shimizu & Okutomi, "Sub-pixel estimation error cancellation on area-based matching", IJCV 2005):
///   offset = ½ (a − c) / (max(a, c) − b).
inline float equiangular_offset(int a, int b, int c) {
  const int rise = std::max(a, c) - b;
  return rise <= 0 ? 0.0F : 0.5F * static_cast<float>(a - c) / static_cast<float>(rise);
}

/// The same for sums in succession; 0 at the ends of the range.
inline float subpixel_offset(const std::uint16_t* sums, int index, int count) {
  if (index == 0 || index + 1 >= count) return 0.0F;
  return equiangular_offset(sums[index - 1], sums[index], sums[index + 1]);
}

}  // namespace spartan::internal
