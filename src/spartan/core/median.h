// The middle one of some values.
#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

namespace spartan {

/// The upper one of the two in the middle where their number is even; 0 without any.
template <class T>
T median(std::vector<T> values) {
  if (values.empty()) return T{};
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace spartan
