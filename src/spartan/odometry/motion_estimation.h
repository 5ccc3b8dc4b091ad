// Motion estimation: the published sub-module. From matched landmarks to the motion and its covariance.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/odometry/anchored_point.h"
#include "spartan/odometry/odometry_options.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// A landmark and where the current shot sees it.
struct LandmarkMatch {
  std::size_t landmark = 0;  ///< whatever the caller counts by
  AnchoredPoint point;
  double disparity_variance = 0;
  Pose previous_from_anchor;
  Eigen::Vector3d measured;    ///< (u, v, d) in the current shot
  Eigen::Matrix3d covariance;  ///< of `measured`, pixels²
};

/// What all disparities of a pair are too small by, in pixels: the eyes' directions are never known to the last
/// hundredth of a pixel (0.1 px of 700 is half an arc minute). It shows in the flow of near against far landmarks.
struct DisparityOffset {
  double value = 0;
  double variance = 0;  ///< 0: taken as known
};

struct MotionFit {
  Pose previous_from_current;
  Matrix6d covariance = Matrix6d::Zero();  ///< right perturbation, (translation, rotation)
  std::vector<bool> inlier;                ///< one for each match
  int inliers = 0;
  double rms_px = 0;  ///< of the inliers' residuals, per coordinate
  DisparityOffset offset;
  double noise_scale = 1;  ///< by how much the residuals exceed their stated standard deviations
};

class MotionEstimation {
 public:
  explicit MotionEstimation(const MotionEstimationOptions& options) : options_(options) {}

  /// Start without any knowledge: random samples of three landmarks, each fitted 3D-3D and scored by the reprojection
  /// of all (u, v, d); the best one refined by a weighted 3D-3D fit of its inliers. Nothing with fewer than three
  /// inliers. The same for the same matches.
  std::optional<MotionFit> coarse(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches) const;

  /// Minimises Σ ρ(rᵀ S⁻¹ r) + (δ − offset)²/σ_δ² over the motion and the disparity offset δ,
  /// r = measured + (0, 0, δ) − h(motion, disparity + δ), S = covariance + ∂h/∂d σ_d² ∂h/∂dᵀ, ρ Cauchy, by
  /// Levenberg-Marquardt; residuals beyond `inlier_sigmas` are left out of the last round. The covariance rests on
  /// the residuals seen. Nothing with fewer than six inliers.
  std::optional<MotionFit> fine(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                const Pose& start, const DisparityOffset& offset = {}) const;

 private:
  MotionEstimationOptions options_;
};

}  // namespace spartan
