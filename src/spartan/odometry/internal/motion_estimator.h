// Motion estimation, a sub-module of the published odometry: from matched landmarks to the motion and its covariance.
// Derivation: docs/math/odometry.md.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/odometry/internal/motion/landmark_match.h"
#include "spartan/odometry/odometer.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan::internal {

/// Constant that is missing from all disparities of a pair, in pixels: the relative yaw of the cameras is never
/// calibrated to the last hundredth of a pixel (0.1 px at a focal length of 700 px is half an arc minute). It is
/// observable from the image motion of near against distant landmarks.
struct DisparityOffset {
  double value = 0;
  double variance = 0;  ///< pixels²; 0: the value is exact
};

struct MotionFit {
  Pose previous_from_current;
  Matrix6d covariance = Matrix6d::Zero();  ///< of the right perturbation, (translation, rotation), m² rad²
  std::vector<bool> inlier;                ///< one for each match
  int inliers = 0;
  double rms_px = 0;  ///< root mean square of the inliers' residuals per coordinate, pixels
  DisparityOffset offset;
  double noise_scale = 1;  ///< ratio of the observed to the specified standard deviation of the residuals, at least 1
};

class MotionEstimator {
 public:
  explicit MotionEstimator(const MotionEstimationOptions& options) : options_(options) {}

  /// Coarse motion by RANSAC (Fischler & Bolles, CACM 24, 1981): samples of three landmarks are fitted 3D-3D and scored
  /// by the reprojection of all (u, v, d); the best sample is refined by a weighted 3D-3D fit of its inliers. Where
  /// most landmarks were measured in one camera only, samples are fitted to image positions instead, from the motion
  /// `start`. std::nullopt with fewer than three inliers. Deterministic: the same for the same matches. Where only a
  /// motion of at least `least_inliers` is of interest, fewer samples are drawn.
  std::optional<MotionFit> coarse(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                  int least_inliers = 0, const Pose& start = {}) const;

  /// Which matches a motion explains to within `ransac_threshold_px`: the inliers of coarse().
  std::vector<bool> agreeing(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                             const Pose& previous_from_current) const;

  /// Minimizes Σ ρ(rᵀ S⁻¹ r) + (δ − offset)²/σ_δ² over the motion and the disparity offset δ, with
  /// r = measured + (0, 0, δ) − h(motion, disparity + δ), S = covariance + ∂h/∂d σ_d² ∂h/∂dᵀ and ρ the Cauchy loss, by
  /// Levenberg-Marquardt in three rounds; residuals beyond `inlier_sigmas` are excluded from the next round. The
  /// covariance is that of an M-estimate, scaled to the observed residuals. std::nullopt with fewer than six inliers.
  std::optional<MotionFit> fine(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                const Pose& start, const DisparityOffset& offset = {}) const;

 private:
  MotionEstimationOptions options_;
};

}  // namespace spartan::internal
