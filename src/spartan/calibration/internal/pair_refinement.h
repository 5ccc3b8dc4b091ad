// Refinement of a stereo calibration: the small correction that makes the rows of matched points agree.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "spartan/calibration/pair_check.h"
#include "spartan/core/pose.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan::internal {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// left_from_right with the rotation and the baseline direction of the correction applied.
Pose corrected_left_from_right(const Pose& left_from_right, const PairCorrection& correction);

/// Matches in the rectified view of a pair, scaled to `focal_px`. NaN where a camera model cannot unproject a pixel.
struct RectifiedMatches {
  double focal_px = 0;                             ///< pixels per radian of that view, the mean of both cameras
  std::vector<double> row_error_px, disparity_px;  ///< of each match: left − right
};
/// Cost that compares hypotheses over the same matches: Σ min(r²/σ², 9) with σ = 0.3 px (truncated least squares);
/// a row error that is not finite costs 9.
inline constexpr double kRowSigma_px = 0.3, kMaxRowCost = 9;
double truncated_row_cost(const std::vector<double>& row_error_px);
/// Disparities below this count as negative. A true disparity is never negative, but those of distant points scatter
/// around zero where the yaw is slightly wrong.
inline constexpr double kNegativeDisparity_px = -1.5;
RectifiedMatches rectify_matches(const CameraModel& left, const CameraModel& right, const Pose& left_from_right,
                                 const std::vector<PixelMatch>& matches);

struct PairFit {
  PairCorrection correction, sigma;  ///< estimate and its standard deviations (of focal_ratio: of its logarithm)
  RectifiedMatches given, rows;      ///< with the calibration as given, and with the correction
  double inlier_limit_px = 0;        ///< four times the spread of the row errors, at most kMaxInlierError_px
  std::vector<bool> inlier;          ///< of each match: its corrected row error is within the limit
  int inliers = 0;
  double rms_px = 0;  ///< of the inliers' corrected row errors
  double cost = 0;    ///< truncated_row_cost() plus the priors
};
inline constexpr double kMaxInlierError_px = 3;

/// The values that belong to inliers, of one value per match.
template <class T>
std::vector<T> inliers_of(const std::vector<T>& values, const std::vector<bool>& inlier) {
  std::vector<T> result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (inlier[i]) result.push_back(values[i]);
  }
  return result;
}

struct PairFitOptions {
  /// Parameters to estimate beside pitch and roll; the others keep their given value.
  bool yaw = true, focal = true, baseline = true;
  bool left_radial = false, right_radial = false;
  /// Standard deviations of the priors: how wrong a calibration usually is. The priors bound what the images cannot
  /// observe: the yaw of a narrow field of view, the baseline direction where everything is distant.
  double rotation_sigma_rad = 0.05, baseline_sigma_rad = 0.02, focal_sigma = 0.03, radial_sigma = 0.3;
  double match_sigma_px = 0.15;  ///< lower bound of the standard deviation of a row error
};

/// Robust least squares over the row errors of the rectified view, Σ ρ(r²) plus the priors: Levenberg-Marquardt with
/// Cauchy weights whose scale shrinks from 20 px (graduated non-convexity, Blake & Zisserman 1987), which tolerates a
/// share of wrong matches. Effect of each parameter on a row (x, y in the rectified view at focal length 1, d the
/// disparity): pitch 1 + y², roll x, yaw x y, baseline down d, baseline ahead y d, focal ratio y, radial
/// k y (x² + y²) of each camera (docs/math/pair_check.md).
PairFit fit_pair(const CameraModel& left, const CameraModel& right, const Pose& left_from_right,
                 const std::vector<PixelMatch>& matches, const PairFitOptions& options = {});

}  // namespace spartan::internal
