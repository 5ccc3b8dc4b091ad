#include "spartan/calibration/internal/pair_refinement.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "spartan/numerics/levenberg_marquardt.h"
#include "spartan/numerics/median.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan::internal {
namespace {

constexpr int kParameters = 8, kRotationAndFocal = 4, kAllButRadial = 6;
// Levenberg-Marquardt steps per scale of the robust loss (empirical): few while the scale shrinks without the baseline
// direction, then up to 20 with all parameters at each of three more scales.
constexpr int kStepsPerScale = 6, kFinalSteps = 20, kFinalScales = 3;
using Parameters = Eigen::Matrix<double, kParameters, 1>;

// Order: pitch, yaw, roll, ln(focal ratio); baseline down, baseline ahead; radial left, radial right.
PairCorrection to_correction(const Parameters& p) {
  return {.pitch_rad = p[0],
          .yaw_rad = p[1],
          .roll_rad = p[2],
          .baseline_down_rad = p[4],
          .baseline_ahead_rad = p[5],
          .focal_ratio = std::exp(p[3]),
          .left_radial = p[6],
          .right_radial = p[7]};
}

// The ray of one pixel for the focal length times 1 − h, 1 and 1 + h, interpolated by the parabola through the three
// directions. This keeps the distortion consistent with the focal length without an unprojection in every step.
constexpr double kFocalStep = 0.02;
struct FocalRays {
  Eigen::Vector3d shorter, nominal, longer;  // directions in the camera frame
  Eigen::Vector3d at(double focal_ratio) const {
    const double s = (focal_ratio - 1) / kFocalStep;
    return nominal + 0.5 * s * (longer - shorter) + 0.5 * s * s * (longer - 2 * nominal + shorter);
  }
};

struct RayPair {
  FocalRays left, right;
};

Eigen::Vector3d direction_or_nan(const CameraModel& model, const Eigen::Vector2d& pixel) {
  const auto ray = unproject(model, pixel);
  return ray ? ray->direction : Eigen::Vector3d::Constant(kNan);
}

// A match in the rectified view at focal length 1; NaN where a ray points sideways or backwards.
struct RectifiedPoints {
  Eigen::Vector2d left, right;
  double row_error() const { return left.y() - right.y(); }
  double disparity() const { return left.x() - right.x(); }
};

// The rectified view of a pair with a correction. `ray_ratio`: the focal ratio at which the right camera's rays were
// unprojected.
class CorrectedGeometry {
 public:
  CorrectedGeometry(const Pose& left_from_right, const Parameters& p, double ray_ratio = 1)
      : correction_(to_correction(p)),
        axes_(rectifying_axes(corrected_left_from_right(left_from_right, correction_).inverse())),
        remaining_ratio_(correction_.focal_ratio / ray_ratio) {}

  RectifiedPoints rectify(const RayPair& match) const {
    return {project(match.left, axes_.left_from_rectified, 1, correction_.left_radial),
            project(match.right, axes_.right_from_rectified, remaining_ratio_, correction_.right_radial)};
  }

 private:
  // Rays with z below 0.1 of their length (84° off the axis) are not used.
  static Eigen::Vector2d project(const FocalRays& rays, const Eigen::Matrix3d& from_rectified, double focal_ratio,
                                 double radial) {
    Eigen::Vector3d ray = focal_ratio == 1 ? rays.nominal : rays.at(focal_ratio);
    if (radial != 0 && ray.z() > 0.1) {
      const double square = ray.head<2>().squaredNorm() / (ray.z() * ray.z());
      ray.head<2>() /= 1 + radial * square;
    }
    const Eigen::Vector3d rectified = from_rectified.transpose() * ray;
    if (!(rectified.z() > 0.1 * rectified.norm())) return {kNan, kNan};
    return rectified.head<2>() / rectified.z();
  }
  PairCorrection correction_;
  RectifyingAxes axes_;
  double remaining_ratio_;
};

std::vector<double> finite_only(const std::vector<double>& values) {
  std::vector<double> result;
  std::copy_if(values.begin(), values.end(), std::back_inserter(result), [](double v) { return std::isfinite(v); });
  return result;
}

// The rays of all matches, and their row errors and disparities under any correction.
class MatchRays {
 public:
  MatchRays(const CameraModel& left, const CameraModel& right, const Pose& left_from_right,
            const std::vector<PixelMatch>& matches)
      : right_(right), left_from_right_(left_from_right), matches_(matches) {
    const Eigen::Vector2d left_centre = centre_of(left);
    rays_.resize(matches.size());
    for (std::size_t i = 0; i < matches.size(); ++i) rays_[i].left = focal_rays(left, matches[i].left, left_centre, 1);
    compute_rays(1);
    focal_px_ = 0.5 * (focal_of(left) + focal_of(right));
  }

  /// Unprojects the right camera's pixels again where the focal ratio has left the range in which the parabola is
  /// accurate.
  void update_rays(double focal_ratio) {
    if (std::abs(focal_ratio / ray_ratio_ - 1) > 0.5 * kFocalStep) compute_rays(focal_ratio);
  }
  std::size_t count() const { return rays_.size(); }
  double focal_px() const { return focal_px_; }
  std::vector<double> row_errors(const Parameters& p) const { return rectify(p, &RectifiedPoints::row_error); }
  std::vector<double> disparities(const Parameters& p) const { return rectify(p, &RectifiedPoints::disparity); }
  RectifiedMatches rectified(const Parameters& p) const { return {focal_px_, row_errors(p), disparities(p)}; }

 private:
  static Eigen::Vector2d centre_of(const CameraModel& model) {
    return project(model, Eigen::Vector3d::UnitZ()).value_or(Eigen::Vector2d::Zero());
  }
  static double focal_of(const CameraModel& model) {
    const auto ahead = project_with_jacobian(model, Eigen::Vector3d::UnitZ());
    return ahead ? std::sqrt(std::abs(ahead->by_point.leftCols<2>().determinant())) : 0;
  }
  // A larger focal length moves the ray of a pixel towards the axis.
  static FocalRays focal_rays(const CameraModel& model, const Eigen::Vector2d& pixel, const Eigen::Vector2d& centre,
                              double focal_ratio) {
    const auto scaled = [&](double ratio) {
      return direction_or_nan(model, centre + (pixel - centre) / (ratio * focal_ratio));
    };
    return {scaled(1 - kFocalStep), scaled(1), scaled(1 + kFocalStep)};
  }
  void compute_rays(double focal_ratio) {
    const Eigen::Vector2d centre = centre_of(right_);
    for (std::size_t i = 0; i < rays_.size(); ++i)
      rays_[i].right = focal_rays(right_, matches_[i].right, centre, focal_ratio);
    ray_ratio_ = focal_ratio;
  }
  std::vector<double> rectify(const Parameters& p, double (RectifiedPoints::*value)() const) const {
    const CorrectedGeometry pair(left_from_right_, p, ray_ratio_);
    std::vector<double> result;
    result.reserve(rays_.size());
    for (const RayPair& match : rays_) result.push_back(focal_px_ * (pair.rectify(match).*value)());
    return result;
  }

  const CameraModel& right_;
  const Pose& left_from_right_;
  const std::vector<PixelMatch>& matches_;
  std::vector<RayPair> rays_;
  double ray_ratio_ = 1, focal_px_ = 0;
};

Parameters prior_sigmas(const PairFitOptions& o) {
  constexpr double kFixed = 1e-9;  // standard deviation that holds a parameter at its given value
  const auto if_free = [](bool free, double sigma) { return free ? sigma : kFixed; };
  Parameters sigma;
  sigma << o.rotation_sigma_rad, if_free(o.yaw, o.rotation_sigma_rad), o.rotation_sigma_rad,
      if_free(o.focal, o.focal_sigma), if_free(o.baseline, o.baseline_sigma_rad),
      if_free(o.baseline, o.baseline_sigma_rad), if_free(o.left_radial, o.radial_sigma),
      if_free(o.right_radial, o.radial_sigma);
  return sigma;
}

// Robust least squares over the row errors, in pixels.
class Fitter {
 public:
  Fitter(MatchRays match_rays, const PairFitOptions& options)
      : match_rays_(std::move(match_rays)),
        all_(options.left_radial || options.right_radial ? kParameters : kAllButRadial),
        prior_(prior_sigmas(options).cwiseInverse().cwiseAbs2()),
        min_sigma_px_(options.match_sigma_px) {}

  void run() {
    leverage_ = bounded_leverage();
    // Initial value: the median row error as a pitch. After that the remaining parameters are small.
    at_[0] = std::atan(median(finite_only(residuals(at_))) / match_rays_.focal_px());
    if (median_absolute(at_) > median_absolute(Parameters::Zero())) at_.setZero();
    // Wrong matches may have any disparity, and a large disparity has a large leverage on the baseline direction. It
    // therefore stays fixed until the scale of the loss is 2 px and wrong matches have little weight.
    constexpr double kFirstScale_px = 20, kBaselineScale_px = 2;
    double scale_px = kFirstScale_px;
    const auto shrink = [&] {
      const double spread_px = 1.4826 * median_absolute(at_);
      scale_px = std::max(0.4 * scale_px, 2 * std::max(spread_px, min_sigma_px_));
    };
    free_ = kRotationAndFocal;
    for (double before = 2 * scale_px; scale_px > kBaselineScale_px && scale_px < 0.99 * before;) {
      before = scale_px;
      minimize(scale_px, kStepsPerScale);
      shrink();
    }
    free_ = all_;
    for (int round = 0; round < kFinalScales; ++round) {
      minimize(scale_px, kFinalSteps);
      shrink();
    }
    minimize(scale_px, kFinalSteps);
  }

  const Parameters& at() const { return at_; }
  const MatchRays& match_rays() const { return match_rays_; }
  std::vector<double> residuals(const Parameters& p) const { return match_rays_.row_errors(p); }

  double cost() const {
    return truncated_row_cost(residuals(at_)) + (prior_.array() * at_.array().square()).head(free_).sum();
  }
  /// Standard deviations of the parameters, given that of the inliers' row errors.
  Parameters sigmas(double sigma_px, const std::vector<bool>& inlier) const {
    std::vector<double> weights(match_rays_.count());
    for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = inlier[i] ? 1 / (sigma_px * sigma_px) : 0;
    const Normal normal = normal_equations(weights);
    const auto inverse = normal.matrix.topLeftCorner(free_, free_).inverse();
    Parameters result = Parameters::Zero();
    result.head(free_) = inverse.diagonal().cwiseSqrt();
    return result;
  }

 private:
  struct Normal {
    Eigen::Matrix<double, kParameters, kParameters> matrix;
    Parameters right_side;
  };

  double median_absolute(const Parameters& p) const {
    std::vector<double> values = finite_only(residuals(p));
    for (double& v : values) v = std::abs(v);
    return median(std::move(values));
  }

  // `weights` are inverse variances. Forward differences are accurate enough: the residuals are smooth.
  Normal normal_equations(const std::vector<double>& weights) const {
    constexpr double kStep = 1e-6;
    Normal normal{};
    normal.matrix.setZero();
    normal.right_side.setZero();
    const std::vector<double> here = residuals(at_);
    std::vector<std::vector<double>> moved;
    moved.reserve(kParameters);
    for (int k = 0; k < free_; ++k) {
      Parameters p = at_;
      p[k] += kStep;
      moved.push_back(residuals(p));
    }
    for (std::size_t i = 0; i < here.size(); ++i) {
      if (!std::isfinite(here[i]) || weights[i] == 0) continue;
      Parameters slope = Parameters::Zero();
      for (int k = 0; k < free_; ++k) slope[k] = (moved[static_cast<std::size_t>(k)][i] - here[i]) / kStep;
      if (!slope.allFinite()) continue;
      normal.matrix += weights[i] * slope * slope.transpose();
      normal.right_side -= weights[i] * here[i] * slope;
    }
    for (int k = 0; k < free_; ++k) {
      normal.matrix(k, k) += prior_[k];
      normal.right_side[k] -= prior_[k] * at_[k];
    }
    return normal;
  }

  // Mallows weights 1/(1 + (v/c)⁴), v the distance from the median disparity, c five spreads (at least 20 px). Without
  // them a few wrong matches of outlying disparity determine the baseline direction, at little residual of their own.
  std::vector<double> bounded_leverage() const {
    constexpr double kSpreads = 5, kMinSpread_px = 4;
    std::vector<double> values = match_rays_.disparities(at_);
    const double middle = median(finite_only(values));
    for (double& v : values) v = std::abs(v - middle);
    const double reach = kSpreads * std::max(1.4826 * median(finite_only(values)), kMinSpread_px);
    for (double& v : values) v = std::isfinite(v) ? 1 / (1 + v * v * v * v / (reach * reach * reach * reach)) : 0;
    return values;
  }

  // Cauchy: Σ s² ln(1 + r²/s²)/σ² plus the priors.
  double robust_cost(const Parameters& p, double scale_px) const {
    const double square_scale = scale_px * scale_px, unit = square_scale / (min_sigma_px_ * min_sigma_px_);
    double sum = (prior_.array() * p.array().square()).head(free_).sum();
    const std::vector<double> rows = residuals(p);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double square = rows[i] * rows[i] / square_scale;
      sum += unit * (std::isfinite(square) ? leverage_[i] * std::log1p(square) : 1.0);
    }
    return sum;
  }

  std::vector<double> robust_weights(double scale_px) const {
    const std::vector<double> rows = residuals(at_);
    std::vector<double> weights(rows.size(), 0.0);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double square = rows[i] * rows[i] / (scale_px * scale_px);
      if (std::isfinite(square)) weights[i] = leverage_[i] / ((1 + square) * min_sigma_px_ * min_sigma_px_);
    }
    return weights;
  }

  void minimize(double scale_px, int steps) {
    using FreeNormal = NormalEquations<Eigen::MatrixXd, Eigen::VectorXd>;
    const auto linearize = [&](const Parameters& p) -> FreeNormal {
      at_ = p;
      match_rays_.update_rays(std::exp(at_[3]));
      const Normal normal = normal_equations(robust_weights(scale_px));
      return {robust_cost(at_, scale_px), normal.matrix.topLeftCorner(free_, free_), normal.right_side.head(free_)};
    };
    const auto cost = [&](const Parameters& p) { return robust_cost(p, scale_px); };
    const auto moved = [&](Parameters p, const Eigen::VectorXd& step) {
      p.head(free_) += step;
      return p;
    };
    const LevenbergMarquardtOptions options{.max_steps = steps, .max_rejections = 8, .relative_decrease = 1e-7};
    at_ = minimize_levenberg_marquardt(at_, options, linearize, cost, moved);
    match_rays_.update_rays(std::exp(at_[3]));
  }

  MatchRays match_rays_;
  std::vector<double> leverage_;  // a weight per match
  int all_, free_ = kParameters;  // how many of the first parameters are estimated: finally, and at present
  Parameters prior_, at_ = Parameters::Zero();
  double min_sigma_px_;
};

}  // namespace

Pose corrected_left_from_right(const Pose& left_from_right, const PairCorrection& c) {
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(c.yaw_rad, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(c.pitch_rad, Eigen::Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(c.roll_rad, Eigen::Vector3d::UnitZ());
  // For a baseline along x: x → x + y · down + z · ahead, with its length kept.
  const Eigen::Quaterniond swing = Eigen::AngleAxisd(c.baseline_down_rad, Eigen::Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(-c.baseline_ahead_rad, Eigen::Vector3d::UnitY());
  return {left_from_right.rotation() * turn, swing * left_from_right.translation()};
}

double truncated_row_cost(const std::vector<double>& row_error_px) {
  double sum = 0;
  for (const double row : row_error_px) {
    const double square = row * row / (kRowSigma_px * kRowSigma_px);
    sum += square < kMaxRowCost ? square : kMaxRowCost;
  }
  return sum;
}

RectifiedMatches rectify_matches(const CameraModel& left, const CameraModel& right, const Pose& left_from_right,
                                 const std::vector<PixelMatch>& matches) {
  const MatchRays match_rays(left, right, left_from_right, matches);
  return match_rays.rectified(Parameters::Zero());
}

PairFit fit_pair(const CameraModel& left, const CameraModel& right, const Pose& left_from_right,
                 const std::vector<PixelMatch>& matches, const PairFitOptions& options) {
  Fitter fitter(MatchRays(left, right, left_from_right, matches), options);
  PairFit fit;
  fit.given = fitter.match_rays().rectified(Parameters::Zero());
  fitter.run();
  fit.correction = to_correction(fitter.at());
  fit.rows = fitter.match_rays().rectified(fitter.at());

  std::vector<double> absolute = finite_only(fit.rows.row_error_px);
  for (double& v : absolute) v = std::abs(v);
  const double spread_px = std::max(1.4826 * median(absolute), options.match_sigma_px);
  fit.inlier_limit_px = std::min(4 * spread_px, kMaxInlierError_px);
  double sum = 0;
  for (const double error : fit.rows.row_error_px) {
    const bool fits = std::abs(error) <= fit.inlier_limit_px;
    fit.inlier.push_back(fits);
    fit.inliers += fits ? 1 : 0;
    sum += fits ? error * error : 0;
  }
  fit.rms_px = fit.inliers > 0 ? std::sqrt(sum / fit.inliers) : kNan;
  const Parameters sigma = fitter.sigmas(std::max(fit.rms_px, options.match_sigma_px), fit.inlier);
  fit.sigma = to_correction(sigma);
  fit.sigma.focal_ratio = sigma[3];
  fit.cost = fitter.cost();
  return fit;
}

}  // namespace spartan::internal
