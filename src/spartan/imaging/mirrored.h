// Images beyond their borders.
#pragma once

namespace spartan {

/// The index of any whole number in 0, 1 … size − 1, size − 2 … 1, 0, 1 …: mirrored about the outermost samples, which
/// are not repeated. `size` > 0.
inline int mirrored(int i, int size) {
  if (size == 1) return 0;
  const int period = 2 * (size - 1);
  i = (i % period + period) % period;
  return i < size ? i : period - i;
}

}  // namespace spartan
