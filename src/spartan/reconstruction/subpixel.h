// Sub-pixel disparity from the costs around the best one.
#pragma once

#include <algorithm>
#include <cstdint>

namespace spartan {

/// Offset in (−½, ½) of the minimum near `index`, from the sums on both sides.
/// Costs rise linearly on both sides of a minimum between samples where the signatures are binary, so two lines of
/// equal and opposite slope meet there ("equiangular" fit: Shimizu & Okutomi, "Sub-pixel estimation error cancellation
/// on area-based matching", IJCV 2005):
///   offset = ½ (a − c) / (max(a, c) − b),  a, b, c the costs at index − 1, index, index + 1.
/// At the ends of the range there is none: 0.
inline float subpixel_offset(const std::uint16_t* sums, int index, int count) {
  if (index == 0 || index + 1 >= count) return 0.0F;
  const int a = sums[index - 1], b = sums[index], c = sums[index + 1];
  const int rise = std::max(a, c) - b;
  return rise <= 0 ? 0.0F : 0.5F * static_cast<float>(a - c) / static_cast<float>(rise);
}

}  // namespace spartan
