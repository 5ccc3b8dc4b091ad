// The noise of a sensor, measured beside an IMU whose attitude is far better.
#pragma once

#include <algorithm>

#include "spartan/localization/internal/kalman_update.h"

namespace spartan::internal {

/// Variance of the readings of a sensor over the stated one, by the innovations r of readings that were used (Mehra,
/// *Approaches to adaptive filtering*, 1972): the mean of (r² − H P Hᵀ) / R over the last readings, where the first
/// ones count with the stated value.
class NoiseRatio {
 public:
  /// Variance by which a stated one is multiplied.
  double factor() const { return std::clamp(ratio, kLeast, kMost); }

  /// `stated`: variance of each row of the innovation by the sensor alone.
  void add(const ErrorCovariance& covariance, const Innovation& innovation, double stated) {
    const double predicted = (innovation.jacobian * covariance * innovation.jacobian.transpose()).trace();
    add((innovation.residual.squaredNorm() - predicted) / (innovation.rows() * stated));
  }
  /// A sample of the ratio.
  void add(double sample) {
    ratio += (std::clamp(sample, 0.0, kLargest) - ratio) / weight;
    weight = std::min(weight + 1, kReadings);
  }

  double ratio = 1, weight = kFirst;

 private:
  static constexpr double kFirst = 20, kReadings = 300;  ///< readings that the stated value, and the mean, count for
  static constexpr double kLeast = 0.25, kMost = 16, kLargest = 25;
};

}  // namespace spartan::internal
