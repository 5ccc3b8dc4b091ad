// How a camera model lists its numbers, so that files and checks need no knowledge of any single model.
#pragma once

#include <limits>
#include <string_view>
#include <vector>

namespace spartan {

/// One key of a model in rig.yaml, holding a list of numbers.
struct ModelParameterKind {
  std::string_view key;     ///< with its unit, as "focal_px"
  std::vector<int> counts;  ///< how many numbers there may be
  bool positive = false;    ///< each number must be above zero; all must be finite in any case
  double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();
  bool unit_length = false;  ///< the numbers are a direction of length 1 (within 0.001)
};

/// The numbers of a model, one list for each of its kinds, in their order.
using ModelParameters = std::vector<std::vector<double>>;

}  // namespace spartan
