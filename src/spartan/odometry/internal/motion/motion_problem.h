// The robust least-squares problem of the fine motion.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "spartan/numerics/levenberg_marquardt.h"
#include "spartan/odometry/internal/motion_estimator.h"

namespace spartan::internal {

/// Unknowns: right perturbation of the motion (translation, rotation), then the disparity offset.
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

/// Standard deviation of an error of positions that all landmarks share, as a fraction of their parallax since the
/// anchor: the light comes from one side, so what comes into view with a change of viewpoint moves all patches to the
/// same side. At the true poses of the scenario traverse_100m the mean residual is 3e-4 of the parallax.
inline constexpr double kSharedViewpointError = 3.5e-4;

struct MotionState {
  Pose motion;  ///< previous_from_current
  double offset = 0;
};

/// Matches of landmarks as residuals r = measured + (0, 0, δ) − h(motion, disparity + δ) with weights S⁻¹,
/// S = covariance + ∂h/∂d σ_d² ∂h/∂dᵀ. The weights are those at the state of the latest update_weights(): they change
/// little with the motion.
class MotionProblem {
 public:
  MotionProblem(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches, const DisparityOffset& prior,
                bool robust);

  void update_weights(const MotionState& state);

  /// Squared residuals rᵀ S⁻¹ r of all matches; infinite behind the camera.
  const std::vector<double>& squares(const MotionState& state);
  /// Residual of one match, in pixels.
  Eigen::Vector3d residual(std::size_t match, const MotionState& state) const;

  /// Σ ρ(rᵀ S⁻¹ r) over the matches that are used, and the prior; residuals in units of `noise_scale` standard
  /// deviations.
  double cost(const std::vector<bool>& used, const MotionState& state, double noise_scale) const;
  NormalEquations<Matrix7d, Vector7d> linearize(const std::vector<bool>& used, const MotionState& state,
                                                double noise_scale) const;
  /// Covariance of an M-estimate, A⁻¹ B A⁻¹ (Huber, Robust Statistics, 1981, §6.3), with A = Σ ψ' JᵀS⁻¹J and
  /// B = Σ ψ² JᵀS⁻¹J. The whitened residual has n dimensions (3, or 2 of one camera) and a random direction; averaged
  /// over it, with the weight w(s) of s = rᵀS⁻¹r, ψ' = w + 2/n s w'(s) and ψ² = w² s/n. The error that all
  /// positions share is added to the motion.
  Matrix7d covariance(const std::vector<bool>& used, const MotionState& state, double noise_scale) const;

 private:
  /// A landmark, divided by its depth in its anchor, in the previous frame: along + w · from_anchor, w the inverse
  /// depth.
  struct Entry {
    Eigen::Vector3d along, from_anchor, measured;
    double disparity;
    Eigen::Matrix3d weight;
  };
  struct Projected {
    Eigen::Vector3d q;  // in the current frame, divided by the depth in the anchor
    double w = 0;       // inverse depth in the anchor
    bool in_front = false;
  };
  struct Frame;  // the motion as matrix and translation
  Projected project(const Entry& entry, const Frame& frame, double offset) const;
  Eigen::Vector3d residual(const Entry& entry, const Projected& p, double offset) const;
  double square(const Entry& entry, const Frame& frame, double offset) const;
  Eigen::Matrix<double, 3, 7> jacobian(const Entry& entry, const Projected& p, const Frame& frame, double offset) const;
  /// Calls visit(match, r, J, S⁻¹, s) for each match that is used and in front of the camera, s in units of
  /// `noise_scale`².
  template <class Visit>
  void for_each_residual(const std::vector<bool>& used, const MotionState& state, double noise_scale,
                         const Visit& visit) const;
  double prior_information() const;

  const RectifiedStereo& stereo_;
  const std::vector<LandmarkMatch>& matches_;
  DisparityOffset prior_;
  bool robust_;
  std::vector<Entry> entries_;
  std::vector<double> squares_;
};

}  // namespace spartan::internal
