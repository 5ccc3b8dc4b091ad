// How the calibration of a stereo pair must be changed so that it fits the pictures: a fit to matched places.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

/// The same place in both pictures as taken, pixels.
struct PixelMatch {
  Eigen::Vector2d left, right;
};

/// What is to be changed. Turns are those of the right eye about its own axes as `describe_relative_pose` names them,
/// left_from_right' = left_from_right · Ry(yaw) Rx(pitch) Rz(roll): to the right, up, clockwise. The baseline's
/// direction turns by `baseline_down_rad` and `baseline_ahead_rad`. All of them small.
struct PairCorrection {
  double pitch_rad = 0, yaw_rad = 0, roll_rad = 0;
  double baseline_down_rad = 0, baseline_ahead_rad = 0;
  double focal_ratio = 1;  ///< factor of the right eye's focal length
  /// Of a pinhole that should have been bent: r → r/(1 + k r²) straightens its rays; k is about Brown's k1. 0 where not
  /// asked for.
  double left_radial = 0, right_radial = 0;
};

/// left_from_right with the correction taken in.
Pose corrected_left_from_right(const Pose& left_from_right, const PairCorrection& correction);

/// Where matches lie in the rectified view of a pair, at the scale of `focal_px`. NaN where a model has no line of
/// sight.
struct RectifiedMatches {
  double focal_px = 0;                             ///< pixels per radian of that view, the mean of both eyes
  std::vector<double> row_error_px, disparity_px;  ///< of each match: left − right
};
/// To compare beliefs about the same matches: Σ min(r²/σ², 9), σ = 0.3 px; a row that is no number counts 9.
inline constexpr double kRowUnit_px = 0.3, kMostOfARow = 9;
double cost_of_rows(const std::vector<double>& row_error_px);
/// Nothing is beyond infinity; but what is far away lies on both sides of it where a yaw is off by little.
inline constexpr double kBeyondInfinity_px = -1.5;
RectifiedMatches rectify_matches(const CameraModel& left, const CameraModel& right, const Pose& left_from_right,
                                 const std::vector<PixelMatch>& matches);

struct PairFit {
  PairCorrection correction, sigma;  ///< the estimate and its standard deviations (of the ratio: of its logarithm)
  RectifiedMatches given, rows;      ///< as given, and as corrected
  double inlier_limit_px = 0;        ///< four times the spread of the rows, at most kLargestInlier_px
  std::vector<bool> inlier;          ///< fits the corrected pair
  int inliers = 0;
  double rms_px = 0;  ///< of the inliers' row errors as corrected
  double cost = 0;    ///< cost_of_rows() plus the priors
};
inline constexpr double kLargestInlier_px = 3;

/// What belongs to the inliers, of what there is of every match.
template <class T>
std::vector<T> inliers_of(const std::vector<T>& values, const std::vector<bool>& inlier) {
  std::vector<T> result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (inlier[i]) result.push_back(values[i]);
  }
  return result;
}

struct PairFitOptions {
  /// What is estimated beside pitch and roll; the rest is as given.
  bool yaw = true, focal = true, baseline = true;
  bool left_radial = false, right_radial = false;
  /// What is thought of the errors of a calibration beforehand (standard deviations). They hold what the pictures do
  /// not tell: the yaw of a narrow view, the baseline's direction where all is far away.
  double turn_sigma_rad = 0.05, baseline_sigma_rad = 0.02, focal_sigma = 0.03, radial_sigma = 0.3;
  double match_sigma_px = 0.15;  ///< least standard deviation of a row difference
};

/// Robust least squares over the row differences in the rectified view, Σ ρ(r²) plus the priors, by Levenberg-Marquardt
/// with Cauchy weights whose scale shrinks from 20 px, so that a share of wrong matches does no harm (graduated
/// non-convexity after Blake & Zisserman 1987). What each parameter does to a row (x, y of the rectified view at focal
/// length 1, d the disparity): pitch 1 + y², roll x, yaw x y, baseline down d, baseline ahead y d, focal ratio y,
/// k y (x² + y²) of each eye (docs/math/pair_check.md).
PairFit fit_pair(const CameraModel& left, const CameraModel& right, const Pose& left_from_right,
                 const std::vector<PixelMatch>& matches, const PairFitOptions& options = {});

}  // namespace spartan
