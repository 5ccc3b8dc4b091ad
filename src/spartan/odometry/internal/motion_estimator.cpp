#include "spartan/odometry/internal/motion_estimator.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "spartan/numerics/levenberg_marquardt.h"
#include "spartan/numerics/random.h"
#include "spartan/numerics/umeyama.h"
#include "spartan/odometry/internal/motion/motion_problem.h"

namespace spartan::internal {
namespace {

/// Seed of the RANSAC samples; any constant makes them reproducible.
constexpr std::uint64_t kSeed = 0x5157;
/// Median and first quartile of the chi-squared distribution with three degrees of freedom: s of a (u, v, d) residual;
/// with two: of an image position.
constexpr double kMedianChi3 = 2.366, kMedianChi2 = 1.386;
constexpr double kQuartileChi3 = 1.213, kQuartileChi2 = 0.575;
/// Landmarks with a smaller disparity are too uncertain in depth for a 3D-3D fit; empirical.
constexpr double kMinFitDisparity_px = 0.5;
/// Landmarks of a RANSAC sample.
constexpr std::size_t kSampleSize = 3;
/// RANSAC stops when three inliers have been sampled with this probability of failure.
constexpr double kRansacFailure = 1e-4;
/// With fewer inliers the motion (6 unknowns) is not determined redundantly.
constexpr int kMinInliers = 6;
/// Rounds of minimization and outlier rejection, and Levenberg-Marquardt trials in each; empirical.
constexpr int kRounds = 3, kTrials = 12;

/// Minimizes with the weights of the start.
MotionState minimize(MotionProblem& problem, const std::vector<bool>& used, const MotionState& start,
                     double noise_scale) {
  static constexpr LevenbergMarquardtOptions kOptions{.max_trials = kTrials,
                                                      .initial_damping = 1e-6,
                                                      .min_damping = 1e-9,
                                                      .min_rejected_damping = 1e-4,
                                                      .max_damping = 1e6,
                                                      .relative_decrease = 1e-9,
                                                      .step_rule = StepRule::not_increase};
  problem.update_weights(start);
  const auto moved = [](const MotionState& state, const Vector7d& step) {
    return MotionState{state.motion * exp_se3(step.head<6>()), state.offset + step[6]};
  };
  return minimize_levenberg_marquardt(
      start, kOptions, [&](const MotionState& state) { return problem.linearize(used, state, noise_scale); },
      [&](const MotionState& state) { return problem.cost(used, state, noise_scale); }, moved);
}

double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  const auto rank = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), rank, values.end());
  return *rank;
}

/// Ratio of the observed to the specified standard deviation of the residuals, at least 1: in the first round from the
/// first quartile of all residuals (valid with up to 75 % outliers, and then conservative), then from the median of the
/// inliers.
double noise_scale_of(const std::vector<LandmarkMatch>& matches, const std::vector<double>& squares,
                      const std::vector<bool>& used, bool first) {
  std::vector<double> ratios;
  ratios.reserve(squares.size());
  for (std::size_t i = 0; i < squares.size(); ++i) {
    if (!used[i]) continue;
    const bool both = matches[i].cameras == MeasuredIn::both;
    ratios.push_back(squares[i] /
                     (first ? (both ? kQuartileChi3 : kQuartileChi2) : (both ? kMedianChi3 : kMedianChi2)));
  }
  const double excess = quantile(std::move(ratios), first ? 0.25 : 0.5);
  return std::sqrt(std::max(1.0, std::isfinite(excess) ? excess : 1.0));
}

/// Number of samples of which one consists of inliers with the probability 1 − kRansacFailure, where `fraction` of the
/// matches are inliers.
int samples_for(double fraction) {
  const double all_inliers = std::pow(fraction, 3);
  return 1 + static_cast<int>(std::min(1e6, std::log(kRansacFailure) / std::log(1 - std::min(all_inliers, 0.999))));
}

/// Sets `inlier`, `inliers` and `rms_px`: a match is an inlier where its squared normalized residual is within `limit`.
void classify_inliers(MotionFit& fit, const std::vector<LandmarkMatch>& matches, const MotionProblem& problem,
                      const std::vector<double>& squares, const MotionState& state, double limit) {
  fit.inlier.assign(squares.size(), false);
  fit.inliers = 0;
  double sum = 0;
  for (std::size_t i = 0; i < squares.size(); ++i) {
    if (!(squares[i] <= limit)) continue;
    fit.inlier[i] = true;
    ++fit.inliers;
    sum += matches[i].observed(problem.residual(i, state)).squaredNorm() / matches[i].dimensions();
  }
  fit.rms_px = fit.inliers > 0 ? std::sqrt(sum / fit.inliers) : 0;
}

/// Fits motions to samples of matches: to 3D points before and after, or, where most landmarks were measured in one
/// camera only, to image positions.
class SampleFit {
 public:
  SampleFit(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches, const Pose& start)
      : stereo_(stereo), matches_(matches), start_(start), points_(matches.size()) {
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const LandmarkMatch& m = matches[i];
      if (m.cameras != MeasuredIn::both || m.point.disparity < kMinFitDisparity_px ||
          m.measured.z() < kMinFitDisparity_px)
        continue;
      Point& p = points_[i];
      p.previous = m.previous_from_anchor * stereo.triangulate(m.point.pixel.x(), m.point.pixel.y(), m.point.disparity);
      p.current = stereo.triangulate(m.measured.x(), m.measured.y(), m.measured.z());
      // A disparity error moves a point by z²/(f b) along its ray: the weight is the inverse of the variance.
      p.weight = 1 / std::pow(p.current.z(), 4);
      usable_.push_back(i);
    }
    const auto in_one = std::count_if(matches.begin(), matches.end(),
                                      [](const LandmarkMatch& m) { return m.cameras != MeasuredIn::both; });
    by_pixels_ = 2 * static_cast<std::size_t>(in_one) > matches.size();
    if (!by_pixels_) return;
    usable_.resize(matches.size());
    std::iota(usable_.begin(), usable_.end(), std::size_t{0});
  }

  /// Matches that can be sampled.
  const std::vector<std::size_t>& usable() const { return usable_; }

  std::optional<Pose> fit(const std::vector<std::size_t>& chosen) const {
    if (chosen.size() < kSampleSize) return std::nullopt;
    return by_pixels_ ? fit_pixels(chosen) : fit_points(chosen);
  }

 private:
  struct Point {
    Eigen::Vector3d previous, current;
    double weight = 0;
  };

  std::optional<Pose> fit_points(const std::vector<std::size_t>& chosen) const {
    std::vector<Eigen::Vector3d> a, b;
    std::vector<double> w;
    for (const std::size_t i : chosen) {
      a.push_back(points_[i].previous);
      b.push_back(points_[i].current);
      w.push_back(points_[i].weight);
    }
    const std::optional<UmeyamaFit> fit = fit_umeyama(a, b, FitScale::fixed, w);
    if (!fit || !fit->unique) return std::nullopt;
    return fit->target_from_source.pose;
  }

  std::optional<Pose> fit_pixels(const std::vector<std::size_t>& chosen) const {
    std::vector<LandmarkMatch> sample;
    sample.reserve(chosen.size());
    for (const std::size_t i : chosen) sample.push_back(matches_[i]);
    MotionProblem problem(stereo_, sample, {}, false);
    const Pose motion = minimize(problem, std::vector<bool>(sample.size(), true), {start_, 0}, 1).motion;
    return motion.translation().allFinite() ? std::optional(motion) : std::nullopt;
  }

  const RectifiedStereo& stereo_;
  const std::vector<LandmarkMatch>& matches_;
  Pose start_;
  std::vector<Point> points_;
  std::vector<std::size_t> usable_;
  bool by_pixels_ = false;
};

}  // namespace

std::vector<bool> MotionEstimator::agreeing(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                            const Pose& previous_from_current) const {
  const double limit = options_.ransac_threshold_px * options_.ransac_threshold_px;
  std::vector<bool> agrees(matches.size(), false);
  const Pose current_from_previous = previous_from_current.inverse();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const auto p = project_anchored(stereo, matches[i].point, current_from_previous * matches[i].previous_from_anchor);
    agrees[i] = p && matches[i].observed(p->measured - matches[i].measured).squaredNorm() <= limit;
  }
  return agrees;
}

std::optional<MotionFit> MotionEstimator::coarse(const RectifiedStereo& stereo,
                                                 const std::vector<LandmarkMatch>& matches, int least_inliers,
                                                 const Pose& start) const {
  const SampleFit sample(stereo, matches, start);
  const std::vector<std::size_t>& usable = sample.usable();
  if (usable.size() < kSampleSize) return std::nullopt;
  MotionFit best;
  const auto take_if_better = [&](const std::optional<Pose>& motion, int least) {
    if (!motion) return;
    std::vector<bool> inlier = agreeing(stereo, matches, *motion);
    const auto inliers = static_cast<int>(std::count(inlier.begin(), inlier.end(), true));
    if (inliers < least) return;
    best.previous_from_current = *motion;
    best.inliers = inliers;
    best.inlier = std::move(inlier);
  };
  Random random(kSeed);
  const auto count = static_cast<std::uint32_t>(usable.size());
  const auto all = static_cast<double>(matches.size());
  int iterations = options_.ransac_iterations;
  if (least_inliers > 0) iterations = std::min(iterations, samples_for(least_inliers / all));
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const std::size_t i = random.below(count), j = random.below(count), k = random.below(count);
    if (i == j || j == k || i == k) continue;
    const int before = best.inliers;
    take_if_better(sample.fit({usable[i], usable[j], usable[k]}), before + 1);
    if (best.inliers == before) continue;
    const double fraction = best.inliers / all;
    if (std::pow(fraction, 3) > 0.999) break;
    iterations = std::min(iterations, iteration + samples_for(fraction));
  }
  if (best.inliers < static_cast<int>(kSampleSize)) return std::nullopt;

  std::vector<std::size_t> chosen;
  for (const std::size_t i : usable)
    if (best.inlier[i]) chosen.push_back(i);
  take_if_better(sample.fit(chosen), best.inliers);
  return best;
}

std::optional<MotionFit> MotionEstimator::fine(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                               const Pose& start, const DisparityOffset& offset) const {
  MotionProblem problem(stereo, matches, offset, options_.robust);
  MotionFit fit;
  fit.offset = offset;
  const double limit = options_.inlier_sigmas * options_.inlier_sigmas;
  std::vector<bool> used(matches.size(), true);
  MotionState state{start, offset.value};
  for (int round = 0; round < kRounds; ++round) {
    state = minimize(problem, used, state, fit.noise_scale);
    fit.previous_from_current = state.motion;
    fit.offset.value = state.offset;
    problem.update_weights(state);
    const std::vector<double>& squares = problem.squares(state);
    fit.noise_scale = noise_scale_of(matches, squares, used, round == 0);
    classify_inliers(fit, matches, problem, squares, state, limit * fit.noise_scale * fit.noise_scale);
    used = fit.inlier;
    if (fit.inliers < kMinInliers) return std::nullopt;
  }
  const Matrix7d covariance = problem.covariance(used, state, fit.noise_scale);
  if (!covariance.allFinite() || !(covariance.diagonal().minCoeff() > 0)) return std::nullopt;
  fit.covariance = covariance.topLeftCorner<6, 6>();
  fit.offset.variance = covariance(6, 6);
  return fit;
}

}  // namespace spartan::internal
