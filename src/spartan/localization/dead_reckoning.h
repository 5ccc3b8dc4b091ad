// How far the product of visual motions may be off: the covariance of a drive by odometry alone.
#pragma once

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/localization/localization_options.h"
#include "spartan/localization/localizer.h"

namespace spartan {

/// Propagates the covariance of a pose that is the product of motions, with the errors that last: white noise n and two
/// first-order Gauss–Markov processes z₁ and z₂ in units of each motion's standard deviations D,
///
///     ξ' = Ad(M⁻¹) ξ + D (z₁ + z₂) + n
///
/// (docs/math/localization.md, "Vision"). Nothing is estimated: a fixed amount of arithmetic for each motion. Equals
/// the covariance of VisionOnlyFilter without constraints to first order; where vision is lost, the motion's own
/// covariance counts.
class DeadReckoning {
 public:
  explicit DeadReckoning(const VisionOptions& options);

  /// The next motion; each begins where the last one ended.
  void add(const RelativeMotion& motion);
  /// Of the right perturbation of the pose since the start, which is exact; order (translation, rotation).
  Matrix6d covariance() const { return covariance_.topLeftCorner<6, 6>(); }

  /// The memory as a versioned value. Code `store_damaged` where it is not one.
  Bytes save() const;
  Status restore(const Bytes& bytes);

 private:
  static constexpr int kSize = 18;  // ξ, z₁, z₂
  using Covariance = Eigen::Matrix<double, kSize, kSize>;
  void age(int index, const Vector6d& sigmas, double steps);

  double white_factor_, drift_steps_;
  Vector6d drift_sigmas_ = Vector6d::Zero(), constant_sigmas_ = Vector6d::Zero();
  Covariance covariance_ = Covariance::Zero();
};

}  // namespace spartan
