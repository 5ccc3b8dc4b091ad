// Border extrapolation by reflection.
#pragma once

namespace spartan::internal {

/// Reflects an index at the outermost samples without repeating them (as cv::BORDER_REFLECT_101):
/// 0, 1 … size − 1, size − 2 … 1, 0, 1 … for any integer. `size` > 0.
inline int mirrored(int i, int size) {
  if (size == 1) return 0;
  const int period = 2 * (size - 1);
  i = (i % period + period) % period;
  return i < size ? i : period - i;
}

}  // namespace spartan::internal
