#include "spartan/odometry/motion_estimation.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "spartan/core/random.h"
#include "spartan/odometry/rigid_fit.h"

namespace spartan {
namespace {

constexpr std::uint64_t kSeed = 0x5157;
/// Cauchy's scale: ρ(s) = c² ln(1 + s/c²), in squared standard deviations.
constexpr double kCauchy = 6.0;
/// Median of the squared length of three unit normals.
constexpr double kMedianChi3 = 2.366;
/// Points further than this many baselines weigh nothing in a 3D-3D fit.
constexpr double kLeastDisparityForFit_px = 0.5;
constexpr int kRounds = 3, kIterations = 12;

/// Residual in units of its standard deviation, squared, and what it adds to the normal equations.
struct Term {
  double squared = std::numeric_limits<double>::infinity();
  Eigen::Matrix<double, 6, 6> information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();
};

Term term_of(const RectifiedStereo& stereo, const LandmarkMatch& match, const Pose& current_from_previous) {
  Term term;
  const auto p = project_anchored(stereo, match.point, current_from_previous * match.previous_from_anchor);
  if (!p) return term;
  const Eigen::Matrix3d spread =
      match.covariance + match.disparity_variance * p->by_disparity * p->by_disparity.transpose();
  const Eigen::Matrix3d weight = spread.inverse();
  term.residual = match.measured - p->measured;
  term.squared = term.residual.dot(weight * term.residual);
  const Eigen::Matrix<double, 6, 3> jw = p->by_motion.transpose() * weight;
  term.information = jw * p->by_motion;
  term.gradient = jw * term.residual;
  return term;
}

struct Normal {
  double cost = 0;
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
};

Normal normal_equations(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                        const std::vector<bool>& used, const Pose& motion, double noise_scale, bool robust) {
  Normal normal;
  const Pose current_from_previous = motion.inverse();
  const double scale = 1 / (noise_scale * noise_scale);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!used[i]) continue;
    const Term term = term_of(stereo, matches[i], current_from_previous);
    if (!std::isfinite(term.squared)) {
      normal.cost += kCauchy * 10;
      continue;
    }
    const double s = term.squared * scale;
    const double weight = robust ? 1 / (1 + s / kCauchy) : 1;
    normal.cost += robust ? kCauchy * std::log1p(s / kCauchy) : s;
    normal.information += weight * scale * term.information;
    normal.gradient += weight * scale * term.gradient;
  }
  return normal;
}

/// Levenberg-Marquardt over the motion.
Pose minimise(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches, const std::vector<bool>& used,
              Pose motion, double noise_scale, bool robust) {
  double damping = 1e-6;
  Normal here = normal_equations(stereo, matches, used, motion, noise_scale, robust);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Matrix6d damped = here.information;
    damped.diagonal() *= 1 + damping;
    const Vector6d step = damped.ldlt().solve(here.gradient);
    if (!step.allFinite()) break;
    const Pose tried = motion * exp_se3(step);
    const Normal there = normal_equations(stereo, matches, used, tried, noise_scale, robust);
    if (there.cost <= here.cost) {
      const double gain = here.cost - there.cost;
      motion = tried;
      here = there;
      damping = std::max(damping * 0.1, 1e-9);
      if (gain <= 1e-9 * here.cost) break;
    } else {
      damping = std::max(damping * 10, 1e-4);
      if (damping > 1e6) break;
    }
  }
  return motion;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Fills `inlier`, `inliers` and `rms_px` for a motion.
void judge(MotionFit& fit, const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches, double limit) {
  const Pose current_from_previous = fit.previous_from_current.inverse();
  fit.inlier.assign(matches.size(), false);
  fit.inliers = 0;
  double sum = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Term term = term_of(stereo, matches[i], current_from_previous);
    if (!(term.squared <= limit)) continue;
    fit.inlier[i] = true;
    ++fit.inliers;
    sum += term.residual.squaredNorm() / 3;
  }
  fit.rms_px = fit.inliers > 0 ? std::sqrt(sum / fit.inliers) : 0;
}

}  // namespace

std::optional<MotionFit> MotionEstimation::coarse(const RectifiedStereo& stereo,
                                                  const std::vector<LandmarkMatch>& matches) const {
  std::vector<Eigen::Vector3d> previous, current;
  std::vector<double> weights;
  std::vector<std::size_t> usable;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const LandmarkMatch& m = matches[i];
    if (m.point.disparity < kLeastDisparityForFit_px || m.measured.z() < kLeastDisparityForFit_px) continue;
    usable.push_back(i);
    previous.push_back(m.previous_from_anchor *
                       stereo.triangulate(m.point.pixel.x(), m.point.pixel.y(), m.point.disparity));
    current.push_back(stereo.triangulate(m.measured.x(), m.measured.y(), m.measured.z()));
    // A point's spread grows with z²; z/d of a disparity error.
    weights.push_back(1 / std::pow(current.back().z(), 4));
  }
  if (usable.size() < 3) return std::nullopt;

  const double limit = options_.coarse_tolerance_px * options_.coarse_tolerance_px;
  const auto within = [&](const Pose& motion) {
    std::vector<bool> inlier(matches.size(), false);
    int count = 0;
    const Pose current_from_previous = motion.inverse();
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const auto p =
          project_anchored(stereo, matches[i].point, current_from_previous * matches[i].previous_from_anchor);
      if (p && (p->measured - matches[i].measured).squaredNorm() <= limit) {
        inlier[i] = true;
        ++count;
      }
    }
    return std::pair(count, std::move(inlier));
  };
  const auto fit_of = [&](const std::vector<std::size_t>& chosen) {
    std::vector<Eigen::Vector3d> a, b;
    std::vector<double> w;
    for (const std::size_t k : chosen) {
      a.push_back(previous[k]);
      b.push_back(current[k]);
      w.push_back(weights[k]);
    }
    return fit_rigid(a, b, w);
  };

  MotionFit best;
  Random random(kSeed);
  const auto count = static_cast<std::uint32_t>(usable.size());
  int rounds = options_.ransac_rounds;
  for (int round = 0; round < rounds; ++round) {
    const std::size_t i = random.below(count), j = random.below(count), k = random.below(count);
    if (i == j || j == k || i == k) continue;
    const std::optional<Pose> motion = fit_of({i, j, k});
    if (!motion) continue;
    auto [inliers, inlier] = within(*motion);
    if (inliers <= best.inliers) continue;
    best.previous_from_current = *motion;
    best.inliers = inliers;
    best.inlier = std::move(inlier);
    // Enough rounds to have met three inliers with a probability of 0.9999.
    const double share = std::pow(static_cast<double>(inliers) / static_cast<double>(matches.size()), 3);
    if (share > 0.999) break;
    rounds = std::min(rounds, round + 1 + static_cast<int>(std::log(1e-4) / std::log(1 - share)));
  }
  if (best.inliers < 3) return std::nullopt;

  std::vector<std::size_t> chosen;
  for (std::size_t k = 0; k < usable.size(); ++k)
    if (best.inlier[usable[k]]) chosen.push_back(k);
  if (const std::optional<Pose> motion = fit_of(chosen)) {
    auto [inliers, inlier] = within(*motion);
    if (inliers >= best.inliers) {
      best.previous_from_current = *motion;
      best.inliers = inliers;
      best.inlier = std::move(inlier);
    }
  }
  return best;
}

std::optional<MotionFit> MotionEstimation::fine(const RectifiedStereo& stereo,
                                                const std::vector<LandmarkMatch>& matches, const Pose& start) const {
  MotionFit fit;
  fit.previous_from_current = start;
  const double limit = options_.inlier_sigmas * options_.inlier_sigmas;
  std::vector<bool> used(matches.size(), true);
  for (int round = 0; round < kRounds; ++round) {
    fit.previous_from_current =
        minimise(stereo, matches, used, fit.previous_from_current, fit.noise_scale, options_.robust);
    std::vector<double> squared;
    const Pose current_from_previous = fit.previous_from_current.inverse();
    for (const LandmarkMatch& match : matches) {
      const double s = term_of(stereo, match, current_from_previous).squared;
      if (std::isfinite(s)) squared.push_back(s);
    }
    fit.noise_scale = std::sqrt(std::max(1.0, median(squared) / kMedianChi3));
    judge(fit, stereo, matches, limit * fit.noise_scale * fit.noise_scale);
    used = fit.inlier;
    if (fit.inliers < 6) return std::nullopt;
  }
  const Normal normal =
      normal_equations(stereo, matches, used, fit.previous_from_current, fit.noise_scale, options_.robust);
  fit.covariance = normal.information.ldlt().solve(Matrix6d::Identity());
  fit.covariance = (0.5 * (fit.covariance + fit.covariance.transpose())).eval();
  if (!fit.covariance.allFinite() || !(fit.covariance.diagonal().minCoeff() > 0)) return std::nullopt;
  return fit;
}

}  // namespace spartan
