// The errors of vision that last: a slowly changing part, and one that is constant over a drive.
#pragma once

#include <vector>

#include "spartan/localization/internal/error_state.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

/// Correlation length of the constant part, in frames: finite, so that a filter does not become overconfident;
/// empirical.
inline constexpr double kConstantDriftFrames = 5000;

/// Throws std::invalid_argument unless there are six.
Vector6d six_sigma_ratios(const std::vector<double>& values);

/// What is left of a Gauss–Markov process after one frame.
double drift_that_stays(double correlation_frames);

/// One step of the process at `index` of a covariance, whose stationary standard deviations are `sigmas`.
template <class Covariance>
void propagate_drift(Covariance& p, int index, const Vector6d& sigmas, double stays) {
  p.template middleRows<6>(index) *= stays;
  p.template middleCols<6>(index) *= stays;
  p.diagonal().template segment<6>(index) += (1 - stays * stays) * sigmas.cwiseAbs2();
}

/// Both processes of the filter, in units of the standard deviations of a visual motion (VisionOptions).
class VisionDrift {
 public:
  /// Throws std::invalid_argument unless both lists of the options have six numbers.
  explicit VisionDrift(const VisionOptions& options);

  /// Their variances before any motion.
  void start(ErrorCovariance& p) const;
  /// To the next motion.
  void propagate(StateEstimate& estimate) const;

 private:
  Vector6d slow_sigmas_, constant_sigmas_;
  double slow_stays_;
};

}  // namespace spartan::internal
