// Sub-pixel interpolation of the disparity from the aggregated costs around the minimum.
#pragma once

#include <algorithm>
#include <cstdint>

namespace spartan::internal {

/// Offset in (−½, ½) of the minimum near `index`, from the sums on both sides. Hamming distances rise about linearly on
/// both sides of the minimum, so two lines of equal and opposite slope are intersected ("equiangular" fit: Shimizu &
/// Okutomi, "Sub-pixel estimation error cancellation on area-based matching", IJCV 2005):
///   offset = ½ (a − c) / (max(a, c) − b),  a, b, c the costs at index − 1, index, index + 1.
/// It is 0 at the ends of the range.
inline float subpixel_offset(const std::uint16_t* sums, int index, int count) {
  if (index == 0 || index + 1 >= count) return 0.0F;
  const int a = sums[index - 1], b = sums[index], c = sums[index + 1];
  const int rise = std::max(a, c) - b;
  return rise <= 0 ? 0.0F : 0.5F * static_cast<float>(a - c) / static_cast<float>(rise);
}

}  // namespace spartan::internal
