// Vignetting: the loss of light towards the image border.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "spartan/core/image.h"

namespace spartan {

/// Relative illumination, light at a pixel over light at the centre: 1 + a1 ρ² + a2 ρ⁴ + a3 ρ⁶, where ρ is the distance
/// from the centre over half the image diagonal. No coefficients: no vignetting.
struct Vignetting {
  std::vector<double> coefficients;          ///< a1, a2, a3; missing ones are 0
  std::optional<Eigen::Vector2d> centre_px;  ///< none: the principal point

  /// Smallest relative illumination that is corrected; amplifying darker pixels (more than 8 times) yields mostly
  /// noise.
  static constexpr double kMinIllumination = 0.125;

  /// Relative illumination at ρ².
  double relative_illumination(double rho_squared) const {
    double sum = 0;
    for (std::size_t i = coefficients.size(); i-- > 0;) sum = (sum + coefficients[i]) * rho_squared;
    return 1 + sum;
  }
  friend bool operator==(const Vignetting&, const Vignetting&) = default;
};

}  // namespace spartan
