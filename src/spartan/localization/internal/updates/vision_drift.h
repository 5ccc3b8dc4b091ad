// The errors of vision that last: a slowly changing part, and one that is constant over a drive.
#pragma once

#include "spartan/localization/internal/error_state.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

/// Gauss–Markov processes in units of the standard deviations of a visual motion (VisionOptions).
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
  double slow_frames_;
};

}  // namespace spartan::internal
