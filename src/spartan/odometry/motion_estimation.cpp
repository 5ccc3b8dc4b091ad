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
/// Its first quartile.
constexpr double kQuartileChi3 = 1.213;
/// Points further than this many baselines weigh nothing in a 3D-3D fit.
constexpr double kLeastDisparityForFit_px = 0.5;
/// Information (px⁻²) that pins the offset where it is taken as known.
constexpr double kCertain = 1e12;
/// Fewer inliers than this do not fix a motion well.
constexpr int kFewest = 6;
constexpr int kRounds = 3, kIterations = 12;

/// Unknowns: right perturbation of the motion (translation, rotation), then the disparity offset.
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;
struct Guess {
  Pose motion;
  double offset = 0;
};

/// Residual in units of its standard deviation, squared, and what it adds to the normal equations.
struct Term {
  double squared = std::numeric_limits<double>::infinity();
  Matrix7d information = Matrix7d::Zero();
  Vector7d gradient = Vector7d::Zero();
  Eigen::Vector3d residual = Eigen::Vector3d::Zero();
};

Term term_of(const RectifiedStereo& stereo, const LandmarkMatch& match, const Pose& current_from_previous,
             double offset) {
  Term term;
  const AnchoredPoint point{match.point.pixel, match.point.disparity + offset};
  const auto p = project_anchored(stereo, point, current_from_previous * match.previous_from_anchor);
  if (!p) return term;
  const Eigen::Matrix3d spread =
      match.covariance + match.disparity_variance * p->by_disparity * p->by_disparity.transpose();
  const Eigen::Matrix3d weight = spread.inverse();
  term.residual = match.measured + Eigen::Vector3d(0, 0, offset) - p->measured;
  term.squared = term.residual.dot(weight * term.residual);
  Eigen::Matrix<double, 3, 7> jacobian;
  jacobian << p->by_motion, p->by_disparity - Eigen::Vector3d(0, 0, 1);
  const Eigen::Matrix<double, 7, 3> jw = jacobian.transpose() * weight;
  term.information = jw * jacobian;
  term.gradient = jw * term.residual;
  return term;
}

struct Normal {
  double cost = 0;
  Matrix7d information = Matrix7d::Zero();
  Vector7d gradient = Vector7d::Zero();
};

/// A robust least-squares problem in the motion and the offset.
struct Problem {
  const RectifiedStereo& stereo;
  const std::vector<LandmarkMatch>& matches;
  DisparityOffset prior;
  bool robust;
};

double information_of(const DisparityOffset& prior) {
  return prior.variance > 0 ? 1 / prior.variance : kCertain;
}

Normal normal_equations(const Problem& problem, const std::vector<bool>& used, const Guess& guess, double noise_scale) {
  Normal normal;
  const Pose current_from_previous = guess.motion.inverse();
  const double scale = 1 / (noise_scale * noise_scale);
  for (std::size_t i = 0; i < problem.matches.size(); ++i) {
    if (!used[i]) continue;
    const Term term = term_of(problem.stereo, problem.matches[i], current_from_previous, guess.offset);
    if (!std::isfinite(term.squared)) {
      normal.cost += kCauchy * 10;
      continue;
    }
    const double s = term.squared * scale;
    const double weight = problem.robust ? 1 / (1 + s / kCauchy) : 1;
    normal.cost += problem.robust ? kCauchy * std::log1p(s / kCauchy) : s;
    normal.information += weight * scale * term.information;
    normal.gradient += weight * scale * term.gradient;
  }
  const double known = information_of(problem.prior);
  const double change = problem.prior.value - guess.offset;
  normal.cost += known * change * change;
  normal.information(6, 6) += known;
  normal.gradient[6] += known * change;
  return normal;
}

/// Levenberg-Marquardt.
Guess minimise(const Problem& problem, const std::vector<bool>& used, Guess guess, double noise_scale) {
  double damping = 1e-6;
  Normal here = normal_equations(problem, used, guess, noise_scale);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Matrix7d damped = here.information;
    damped.diagonal() *= 1 + damping;
    const Vector7d step = damped.ldlt().solve(here.gradient);
    if (!step.allFinite()) break;
    const Guess tried{guess.motion * exp_se3(step.head<6>()), guess.offset + step[6]};
    const Normal there = normal_equations(problem, used, tried, noise_scale);
    if (there.cost <= here.cost) {
      const double gain = here.cost - there.cost;
      guess = tried;
      here = there;
      damping = std::max(damping * 0.1, 1e-9);
      if (gain <= 1e-9 * here.cost) break;
    } else {
      damping = std::max(damping * 10, 1e-4);
      if (damping > 1e6) break;
    }
  }
  return guess;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto place = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), place, values.end());
  return *place;
}

/// By how much residuals exceed their stated standard deviations: first from the best quarter of all (right up to 75 %
/// outliers, if careful), then from the median of those that are in use.
double noise_scale_of(const Problem& problem, const std::vector<bool>& used, const Guess& guess, bool first) {
  std::vector<double> squared;
  const Pose current_from_previous = guess.motion.inverse();
  for (std::size_t i = 0; i < problem.matches.size(); ++i) {
    if (!used[i]) continue;
    squared.push_back(term_of(problem.stereo, problem.matches[i], current_from_previous, guess.offset).squared);
  }
  const double excess = first ? quantile(squared, 0.25) / kQuartileChi3 : quantile(squared, 0.5) / kMedianChi3;
  return std::sqrt(std::max(1.0, std::isfinite(excess) ? excess : 1.0));
}

/// Covariance of an M-estimate, A⁻¹ B A⁻¹ (Huber 1981, §6.3): A = Σ ψ' JᵀS⁻¹J and B = Σ ψ² JᵀS⁻¹J, each residual's
/// direction taken at random, so that with weight w(s) of s = rᵀS⁻¹r, ψ' = w + ⅔ s w'(s) and ψ² = w² s/3.
Matrix7d covariance_of(const Problem& problem, const std::vector<bool>& used, const Guess& guess, double noise_scale) {
  Matrix7d a = Matrix7d::Zero(), b = Matrix7d::Zero();
  const Pose current_from_previous = guess.motion.inverse();
  const double scale = 1 / (noise_scale * noise_scale);
  for (std::size_t i = 0; i < problem.matches.size(); ++i) {
    if (!used[i]) continue;
    const Term term = term_of(problem.stereo, problem.matches[i], current_from_previous, guess.offset);
    if (!std::isfinite(term.squared)) continue;
    const double s = term.squared * scale;
    const double weight = problem.robust ? 1 / (1 + s / kCauchy) : 1;
    const double slope = problem.robust ? -weight * weight / kCauchy : 0;
    a += scale * (weight + 2.0 / 3.0 * s * slope) * term.information;
    b += scale * weight * weight * s / 3 * term.information;
  }
  a(6, 6) += information_of(problem.prior);
  b(6, 6) += information_of(problem.prior);
  const Matrix7d inverse = a.ldlt().solve(Matrix7d::Identity());
  const Matrix7d covariance = inverse * b * inverse.transpose();
  return 0.5 * (covariance + covariance.transpose());
}

/// Fills `inlier`, `inliers` and `rms_px` for a motion.
void judge(MotionFit& fit, const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches, double limit) {
  const Pose current_from_previous = fit.previous_from_current.inverse();
  fit.inlier.assign(matches.size(), false);
  fit.inliers = 0;
  double sum = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const Term term = term_of(stereo, matches[i], current_from_previous, fit.offset.value);
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
                                                const std::vector<LandmarkMatch>& matches, const Pose& start,
                                                const DisparityOffset& offset) const {
  const Problem problem{stereo, matches, offset, options_.robust};
  MotionFit fit;
  fit.offset = offset;
  const double limit = options_.inlier_sigmas * options_.inlier_sigmas;
  std::vector<bool> used(matches.size(), true);
  Guess guess{start, offset.value};
  for (int round = 0; round < kRounds; ++round) {
    guess = minimise(problem, used, guess, fit.noise_scale);
    fit.previous_from_current = guess.motion;
    fit.offset.value = guess.offset;
    fit.noise_scale = noise_scale_of(problem, used, guess, round == 0);
    judge(fit, stereo, matches, limit * fit.noise_scale * fit.noise_scale);
    used = fit.inlier;
    if (fit.inliers < kFewest) return std::nullopt;
  }
  const Matrix7d covariance = covariance_of(problem, used, guess, fit.noise_scale);
  if (!covariance.allFinite() || !(covariance.diagonal().minCoeff() > 0)) return std::nullopt;
  fit.covariance = covariance.topLeftCorner<6, 6>();
  fit.offset.variance = covariance(6, 6);
  return fit;
}

}  // namespace spartan
