#include "spartan/odometry/internal/motion_estimator.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "spartan/numerics/levenberg_marquardt.h"
#include "spartan/numerics/random.h"
#include "spartan/numerics/umeyama.h"
#include "spartan/odometry/internal/motion/motion_problem.h"

namespace spartan::internal {
namespace {

/// Seed of the RANSAC samples; any constant makes them reproducible.
constexpr std::uint64_t kSeed = 0x5157;
/// Median and first quartile of the chi-squared distribution with three degrees of freedom: s of a (u, v, d) residual.
constexpr double kMedianChi3 = 2.366;
constexpr double kQuartileChi3 = 1.213;
/// Landmarks with a smaller disparity are too uncertain in depth for a 3D-3D fit; empirical.
constexpr double kMinFitDisparity_px = 0.5;
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
double noise_scale_of(const std::vector<double>& squares, const std::vector<bool>& used, bool first) {
  std::vector<double> squared;
  squared.reserve(squares.size());
  for (std::size_t i = 0; i < squares.size(); ++i)
    if (used[i]) squared.push_back(squares[i]);
  const double excess =
      first ? quantile(std::move(squared), 0.25) / kQuartileChi3 : quantile(std::move(squared), 0.5) / kMedianChi3;
  return std::sqrt(std::max(1.0, std::isfinite(excess) ? excess : 1.0));
}

/// Number of samples of which one consists of inliers with the probability 1 − kRansacFailure, where `fraction` of the
/// matches are inliers.
int samples_for(double fraction) {
  const double all_inliers = std::pow(fraction, 3);
  return 1 + static_cast<int>(std::min(1e6, std::log(kRansacFailure) / std::log(1 - std::min(all_inliers, 0.999))));
}

/// Sets `inlier`, `inliers` and `rms_px`: a match is an inlier where its squared normalized residual is within `limit`.
void classify_inliers(MotionFit& fit, const MotionProblem& problem, const std::vector<double>& squares,
                      const MotionState& state, double limit) {
  fit.inlier.assign(squares.size(), false);
  fit.inliers = 0;
  double sum = 0;
  for (std::size_t i = 0; i < squares.size(); ++i) {
    if (!(squares[i] <= limit)) continue;
    fit.inlier[i] = true;
    ++fit.inliers;
    sum += problem.residual(i, state).squaredNorm() / 3;
  }
  fit.rms_px = fit.inliers > 0 ? std::sqrt(sum / fit.inliers) : 0;
}

}  // namespace

std::vector<bool> MotionEstimator::agreeing(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                            const Pose& previous_from_current) const {
  const double limit = options_.ransac_threshold_px * options_.ransac_threshold_px;
  std::vector<bool> agrees(matches.size(), false);
  const Pose current_from_previous = previous_from_current.inverse();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const auto p = project_anchored(stereo, matches[i].point, current_from_previous * matches[i].previous_from_anchor);
    agrees[i] = p && (p->measured - matches[i].measured).squaredNorm() <= limit;
  }
  return agrees;
}

std::optional<MotionFit> MotionEstimator::coarse(const RectifiedStereo& stereo,
                                                 const std::vector<LandmarkMatch>& matches, int least_inliers) const {
  std::vector<Eigen::Vector3d> previous, current;
  std::vector<double> weights;
  std::vector<std::size_t> usable;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const LandmarkMatch& m = matches[i];
    if (m.point.disparity < kMinFitDisparity_px || m.measured.z() < kMinFitDisparity_px) continue;
    usable.push_back(i);
    previous.push_back(m.previous_from_anchor *
                       stereo.triangulate(m.point.pixel.x(), m.point.pixel.y(), m.point.disparity));
    current.push_back(stereo.triangulate(m.measured.x(), m.measured.y(), m.measured.z()));
    // A disparity error moves a point by z²/(f b) along its ray: the weight is the inverse of the variance.
    weights.push_back(1 / std::pow(current.back().z(), 4));
  }
  if (usable.size() < 3) return std::nullopt;

  const auto inliers_of = [&](const Pose& motion) {
    std::vector<bool> inlier = agreeing(stereo, matches, motion);
    const auto count = static_cast<int>(std::count(inlier.begin(), inlier.end(), true));
    return std::pair(count, std::move(inlier));
  };
  const auto fit_of = [&](const std::vector<std::size_t>& chosen) -> std::optional<Pose> {
    if (chosen.size() < 3) return std::nullopt;
    std::vector<Eigen::Vector3d> a, b;
    std::vector<double> w;
    for (const std::size_t k : chosen) {
      a.push_back(previous[k]);
      b.push_back(current[k]);
      w.push_back(weights[k]);
    }
    const std::optional<UmeyamaFit> fit = fit_umeyama(a, b, FitScale::fixed, w);
    if (!fit || !fit->unique) return std::nullopt;
    return fit->target_from_source.pose;
  };

  MotionFit best;
  Random random(kSeed);
  const auto count = static_cast<std::uint32_t>(usable.size());
  const auto all = static_cast<double>(matches.size());
  int iterations = options_.ransac_iterations;
  if (least_inliers > 0) iterations = std::min(iterations, samples_for(least_inliers / all));
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const std::size_t i = random.below(count), j = random.below(count), k = random.below(count);
    if (i == j || j == k || i == k) continue;
    const std::optional<Pose> motion = fit_of({i, j, k});
    if (!motion) continue;
    auto [inliers, inlier] = inliers_of(*motion);
    if (inliers <= best.inliers) continue;
    best.previous_from_current = *motion;
    best.inliers = inliers;
    best.inlier = std::move(inlier);
    if (std::pow(inliers / all, 3) > 0.999) break;
    iterations = std::min(iterations, iteration + samples_for(inliers / all));
  }
  if (best.inliers < 3) return std::nullopt;

  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < usable.size(); ++k)
    if (best.inlier[usable[k]]) chosen.push_back(k);
  if (const std::optional<Pose> motion = fit_of(chosen)) {
    auto [inliers, inlier] = inliers_of(*motion);
    if (inliers >= best.inliers) {
      best.previous_from_current = *motion;
      best.inliers = inliers;
      best.inlier = std::move(inlier);
    }
  }
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
    fit.noise_scale = noise_scale_of(squares, used, round == 0);
    classify_inliers(fit, problem, squares, state, limit * fit.noise_scale * fit.noise_scale);
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
