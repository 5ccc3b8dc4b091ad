// The median of a list of values.
#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

namespace spartan {

/// The median; for an even number of values the larger of the two middle ones; T{} for an empty list.
template <class T>
T median(std::vector<T> values) {
  if (values.empty()) return T{};
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace spartan
