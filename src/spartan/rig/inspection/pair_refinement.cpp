#include "spartan/rig/inspection/pair_refinement.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "spartan/core/levenberg_marquardt.h"
#include "spartan/core/median.h"
#include "spartan/rig/rectifying_axes.h"

namespace spartan {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kParameters = 8, kWithoutBaseline = 4, kWithoutRadial = 6;
constexpr int kStepsPerScale = 6, kLastSteps = 20, kLastScales = 3;
using Parameters = Eigen::Matrix<double, kParameters, 1>;

// pitch, yaw, roll, ln(focal ratio); baseline down, baseline ahead; bend left, bend right.
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

// The line of sight of one eye for its focal length times 1 − h, 1, 1 + h: in between by the parabola through them. So
// a lens bends its rays as the corrected focal length says, without asking it again in every step.
constexpr double kFocalStep = 0.02;
struct Sight {
  Eigen::Vector3d less, here, more;  // directions in the eye's own frame
  Eigen::Vector3d at(double focal_ratio) const {
    const double s = (focal_ratio - 1) / kFocalStep;
    return here + 0.5 * s * (more - less) + 0.5 * s * s * (more - 2 * here + less);
  }
};

struct RayMatch {
  Sight left, right;
};

Eigen::Vector3d direction_or_nan(const CameraModel& model, const Eigen::Vector2d& pixel) {
  const auto ray = unproject(model, pixel);
  return ray ? ray->direction : Eigen::Vector3d::Constant(kNan);
}

// Where both eyes see a match in the rectified view at focal length 1; NaN beside or behind it.
struct Seen {
  Eigen::Vector2d left, right;
  double row_error() const { return left.y() - right.y(); }
  double disparity() const { return left.x() - right.x(); }
};

// The view of a pair with a correction. `known_ratio`: for which the sights of the right eye were made.
class CorrectedPair {
 public:
  CorrectedPair(const Pose& left_from_right, const Parameters& p, double known_ratio = 1)
      : correction_(to_correction(p)),
        axes_(rectifying_axes(corrected_left_from_right(left_from_right, correction_).inverse())),
        further_ratio_(correction_.focal_ratio / known_ratio) {}

  Seen look(const RayMatch& match) const {
    return {place(match.left, axes_.left_from_rectified, 1, correction_.left_radial),
            place(match.right, axes_.right_from_rectified, further_ratio_, correction_.right_radial)};
  }

 private:
  static Eigen::Vector2d place(const Sight& sight, const Eigen::Matrix3d& from_rectified, double focal_ratio,
                               double radial) {
    Eigen::Vector3d changed = focal_ratio == 1 ? sight.here : sight.at(focal_ratio);
    if (radial != 0 && changed.z() > 0.1) {
      const double square = changed.head<2>().squaredNorm() / (changed.z() * changed.z());
      changed.head<2>() /= 1 + radial * square;
    }
    const Eigen::Vector3d seen = from_rectified.transpose() * changed;
    if (!(seen.z() > 0.1 * seen.norm())) return {kNan, kNan};
    return seen.head<2>() / seen.z();
  }
  PairCorrection correction_;
  RectifyingAxes axes_;
  double further_ratio_;
};

std::vector<double> finite_only(const std::vector<double>& values) {
  std::vector<double> result;
  std::copy_if(values.begin(), values.end(), std::back_inserter(result), [](double v) { return std::isfinite(v); });
  return result;
}

// What a pair looks like to its models: the places of matches for any correction.
class PairOfLenses {
 public:
  PairOfLenses(const CameraModel& left, const CameraModel& right, const Pose& left_from_right,
               const std::vector<PixelMatch>& matches)
      : right_(right), left_from_right_(left_from_right), matches_(matches) {
    const Eigen::Vector2d left_centre = centre_of(left);
    rays_.resize(matches.size());
    for (std::size_t i = 0; i < matches.size(); ++i) rays_[i].left = sight_of(left, matches[i].left, left_centre, 1);
    aim(1);
    focal_px_ = 0.5 * (focal_of(left) + focal_of(right));
  }

  /// The right eye's lines of sight are made anew where the focal length is so far from what they were made for that
  /// the parabola would show.
  void keep_aimed(double focal_ratio) {
    if (std::abs(focal_ratio / known_ratio_ - 1) > 0.5 * kFocalStep) aim(focal_ratio);
  }
  std::size_t count() const { return rays_.size(); }
  double focal_px() const { return focal_px_; }
  std::vector<double> row_errors(const Parameters& p) const { return look(p, &Seen::row_error); }
  std::vector<double> disparities(const Parameters& p) const { return look(p, &Seen::disparity); }
  RectifiedMatches rectified(const Parameters& p) const { return {focal_px_, row_errors(p), disparities(p)}; }

 private:
  static Eigen::Vector2d centre_of(const CameraModel& model) {
    return project(model, Eigen::Vector3d::UnitZ()).value_or(Eigen::Vector2d::Zero());
  }
  static double focal_of(const CameraModel& model) {
    const auto ahead = project_with_jacobian(model, Eigen::Vector3d::UnitZ());
    return ahead ? std::sqrt(std::abs(ahead->by_point.leftCols<2>().determinant())) : 0;
  }
  // A larger focal length sees a pixel nearer to the axis.
  static Sight sight_of(const CameraModel& model, const Eigen::Vector2d& pixel, const Eigen::Vector2d& centre,
                        double focal_ratio) {
    const auto scaled = [&](double ratio) {
      return direction_or_nan(model, centre + (pixel - centre) / (ratio * focal_ratio));
    };
    return {scaled(1 - kFocalStep), scaled(1), scaled(1 + kFocalStep)};
  }
  void aim(double focal_ratio) {
    const Eigen::Vector2d centre = centre_of(right_);
    for (std::size_t i = 0; i < rays_.size(); ++i)
      rays_[i].right = sight_of(right_, matches_[i].right, centre, focal_ratio);
    known_ratio_ = focal_ratio;
  }
  std::vector<double> look(const Parameters& p, double (Seen::*figure)() const) const {
    const CorrectedPair pair(left_from_right_, p, known_ratio_);
    std::vector<double> result;
    result.reserve(rays_.size());
    for (const RayMatch& ray : rays_) result.push_back(focal_px_ * (pair.look(ray).*figure)());
    return result;
  }

  const CameraModel& right_;
  const Pose& left_from_right_;
  const std::vector<PixelMatch>& matches_;
  std::vector<RayMatch> rays_;
  double known_ratio_ = 1, focal_px_ = 0;
};

Parameters sigmas_beforehand(const PairFitOptions& o) {
  constexpr double kStays = 1e-9;
  const auto if_free = [](bool free, double sigma) { return free ? sigma : kStays; };
  Parameters sigma;
  sigma << o.turn_sigma_rad, if_free(o.yaw, o.turn_sigma_rad), o.turn_sigma_rad, if_free(o.focal, o.focal_sigma),
      if_free(o.baseline, o.baseline_sigma_rad), if_free(o.baseline, o.baseline_sigma_rad),
      if_free(o.left_radial, o.radial_sigma), if_free(o.right_radial, o.radial_sigma);
  return sigma;
}

// Gauss-Newton on the row differences, in pixels.
class Fitter {
 public:
  Fitter(PairOfLenses lenses, const PairFitOptions& options)
      : lenses_(std::move(lenses)),
        all_(options.left_radial || options.right_radial ? kParameters : kWithoutRadial),
        prior_(sigmas_beforehand(options).cwiseInverse().cwiseAbs2()),
        least_sigma_px_(options.match_sigma_px) {}

  void run() {
    leverage_ = bounded_leverage();
    // The median row difference is a pitch; from there on the rest is small.
    at_[0] = std::atan(median(finite_only(residuals(at_))) / lenses_.focal_px());
    if (median_absolute(at_) > median_absolute(Parameters::Zero())) at_.setZero();
    // A wrong match may have any disparity, and a large one pulls hard at the baseline's direction: that stays until
    // wrong matches count little.
    constexpr double kFirstScale_px = 20, kSmallScale_px = 2;
    double scale_px = kFirstScale_px;
    const auto shrink = [&] {
      const double spread_px = 1.4826 * median_absolute(at_);
      scale_px = std::max(0.4 * scale_px, 2 * std::max(spread_px, least_sigma_px_));
    };
    free_ = kWithoutBaseline;
    for (double before = 2 * scale_px; scale_px > kSmallScale_px && scale_px < 0.99 * before;) {
      before = scale_px;
      minimise(scale_px, kStepsPerScale);
      shrink();
    }
    free_ = all_;
    for (int round = 0; round < kLastScales; ++round) {
      minimise(scale_px, kLastSteps);
      shrink();
    }
    minimise(scale_px, kLastSteps);
  }

  const Parameters& at() const { return at_; }
  const PairOfLenses& lenses() const { return lenses_; }
  std::vector<double> residuals(const Parameters& p) const { return lenses_.row_errors(p); }

  double cost() const {
    return cost_of_rows(residuals(at_)) + (prior_.array() * at_.array().square()).head(free_).sum();
  }
  /// Of the parameters, when the inliers' row differences have this standard deviation.
  Parameters sigmas(double sigma_px, const std::vector<bool>& inlier) const {
    std::vector<double> weights(lenses_.count());
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

  // Weights are inverse variances; the derivatives by forward differences, exact enough for so smooth a function.
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

  // Mallows weights: what stands far out in disparity moves the baseline's direction at little cost to itself, so that
  // a few wrong matches could buy it. Such a match counts by how far out it stands.
  std::vector<double> bounded_leverage() const {
    constexpr double kSpreads = 5, kLeastSpread_px = 4;
    std::vector<double> values = lenses_.disparities(at_);
    const double middle = median(finite_only(values));
    for (double& v : values) v = std::abs(v - middle);
    const double reach = kSpreads * std::max(1.4826 * median(finite_only(values)), kLeastSpread_px);
    for (double& v : values) v = std::isfinite(v) ? 1 / (1 + v * v * v * v / (reach * reach * reach * reach)) : 0;
    return values;
  }

  // Σ s² ln(1 + r²/s²)/σ² plus the priors (Cauchy).
  double robust_cost(const Parameters& p, double scale_px) const {
    const double square_scale = scale_px * scale_px, unit = square_scale / (least_sigma_px_ * least_sigma_px_);
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
      if (std::isfinite(square)) weights[i] = leverage_[i] / ((1 + square) * least_sigma_px_ * least_sigma_px_);
    }
    return weights;
  }

  void minimise(double scale_px, int steps) {
    using FreeNormal = NormalEquations<Eigen::MatrixXd, Eigen::VectorXd>;
    const auto linearize = [&](const Parameters& p) -> FreeNormal {
      at_ = p;
      lenses_.keep_aimed(std::exp(at_[3]));
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
    lenses_.keep_aimed(std::exp(at_[3]));
  }

  PairOfLenses lenses_;
  std::vector<double> leverage_;  // a weight for each match
  int all_, free_ = kParameters;  // the first so many parameters are estimated, in the end and now
  Parameters prior_, at_ = Parameters::Zero();
  double least_sigma_px_;
};

}  // namespace

Pose corrected_left_from_right(const Pose& left_from_right, const PairCorrection& c) {
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(c.yaw_rad, Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(c.pitch_rad, Eigen::Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(c.roll_rad, Eigen::Vector3d::UnitZ());
  // x → x + y · down + z · ahead for a baseline along x, without changing its length.
  const Eigen::Quaterniond swing = Eigen::AngleAxisd(c.baseline_down_rad, Eigen::Vector3d::UnitZ()) *
                                   Eigen::AngleAxisd(-c.baseline_ahead_rad, Eigen::Vector3d::UnitY());
  return {left_from_right.rotation() * turn, swing * left_from_right.translation()};
}

double cost_of_rows(const std::vector<double>& row_error_px) {
  double sum = 0;
  for (const double row : row_error_px) {
    const double square = row * row / (kRowUnit_px * kRowUnit_px);
    sum += square < kMostOfARow ? square : kMostOfARow;
  }
  return sum;
}

RectifiedMatches rectify_matches(const CameraModel& left, const CameraModel& right, const Pose& left_from_right,
                                 const std::vector<PixelMatch>& matches) {
  const PairOfLenses lenses(left, right, left_from_right, matches);
  return lenses.rectified(Parameters::Zero());
}

PairFit fit_pair(const CameraModel& left, const CameraModel& right, const Pose& left_from_right,
                 const std::vector<PixelMatch>& matches, const PairFitOptions& options) {
  Fitter fitter(PairOfLenses(left, right, left_from_right, matches), options);
  PairFit fit;
  fit.given = fitter.lenses().rectified(Parameters::Zero());
  fitter.run();
  fit.correction = to_correction(fitter.at());
  fit.rows = fitter.lenses().rectified(fitter.at());

  std::vector<double> absolute = finite_only(fit.rows.row_error_px);
  for (double& v : absolute) v = std::abs(v);
  const double spread_px = std::max(1.4826 * median(absolute), options.match_sigma_px);
  fit.inlier_limit_px = std::min(4 * spread_px, kLargestInlier_px);
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

}  // namespace spartan
