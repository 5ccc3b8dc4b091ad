// Description of the parameters of a camera model, so that file formats and validation work for every model.
#pragma once

#include <limits>
#include <string_view>
#include <vector>

namespace spartan {

/// One parameter of a model: a key in rig.yaml that holds a list of numbers.
struct ModelParameterSpec {
  std::string_view key;     ///< with its unit: "focal_px"
  std::vector<int> counts;  ///< the allowed numbers of values
  bool positive = false;    ///< each value must be positive; all must be finite in any case
  /// Bounds of each value, inclusive.
  double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();
  bool unit_length = false;  ///< the values are a unit vector (within 0.001)
};

/// The values of a model: one list for each ModelParameterSpec, in the same order.
using ModelParameters = std::vector<std::vector<double>>;

}  // namespace spartan
