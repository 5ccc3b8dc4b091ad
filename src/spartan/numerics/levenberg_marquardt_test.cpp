#include "spartan/numerics/levenberg_marquardt.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

namespace spartan {
namespace {

using Normal = NormalEquations<Eigen::Matrix2d, Eigen::Vector2d>;

// Rosenbrock's function as two residuals, 10 (y − x²) and 1 − x; minimum 0 at (1, 1).
Eigen::Vector2d rosenbrock(const Eigen::Vector2d& p) {
  return {10 * (p.y() - p.x() * p.x()), 1 - p.x()};
}
Normal rosenbrock_normal(const Eigen::Vector2d& p) {
  Eigen::Matrix2d jacobian;
  jacobian << -20 * p.x(), 10, -1, 0;
  const Eigen::Vector2d r = rosenbrock(p);
  return {r.squaredNorm(), jacobian.transpose() * jacobian, -jacobian.transpose() * r};
}
double rosenbrock_cost(const Eigen::Vector2d& p) {
  return rosenbrock(p).squaredNorm();
}
Eigen::Vector2d sum(const Eigen::Vector2d& p, const Eigen::Vector2d& step) {
  return p + step;
}

TEST(LevenbergMarquardt, FollowsTheValleyOfRosenbrocksFunction) {
  for (const Eigen::Vector2d& start : {Eigen::Vector2d(-1.2, 1), Eigen::Vector2d(5, -3), Eigen::Vector2d(0, 40)}) {
    const Eigen::Vector2d found = minimize_levenberg_marquardt(start, LevenbergMarquardtOptions{.max_trials = 200},
                                                               rosenbrock_normal, rosenbrock_cost, sum);
    EXPECT_LT((found - Eigen::Vector2d(1, 1)).norm(), 1e-6);
  }
}

TEST(LevenbergMarquardt, SolvesALinearProblemInOneUndampedStep) {
  Eigen::Matrix2d a;
  a << 3, 1, 1, 2;
  const Eigen::Vector2d solution(0.5, -2);
  int linearized = 0;
  const auto cost = [&](const Eigen::Vector2d& p) { return (a * (p - solution)).squaredNorm(); };
  const auto linearize = [&](const Eigen::Vector2d& p) {
    ++linearized;
    return Normal{cost(p), a.transpose() * a, -a.transpose() * a * (p - solution)};
  };
  const LevenbergMarquardtOptions options{.max_steps = 1, .initial_damping = 0};
  const Eigen::Vector2d found = minimize_levenberg_marquardt(Eigen::Vector2d(7, 9), options, linearize, cost, sum);
  EXPECT_LT((found - solution).norm(), 1e-12);
  EXPECT_EQ(linearized, 1);
}

// A gradient of the wrong sign lets no step lower the cost.
TEST(LevenbergMarquardt, EndsAfterRejectionsTrialsAndDamping) {
  const auto uphill = [](const Eigen::Vector2d& p) {
    Normal normal = rosenbrock_normal(p);
    normal.gradient = -normal.gradient;
    return normal;
  };
  const Eigen::Vector2d start(-1.2, 1);
  const auto trials_of = [&](const LevenbergMarquardtOptions& options) {
    int trials = 0;
    const auto counted = [&](const Eigen::Vector2d& p) {
      ++trials;
      return rosenbrock_cost(p) + 1e3;
    };
    EXPECT_EQ(minimize_levenberg_marquardt(start, options, uphill, counted, sum), start);
    return trials;
  };
  EXPECT_EQ(trials_of({.max_rejections = 8}), 8);
  EXPECT_EQ(trials_of({.max_trials = 5}), 5);
  EXPECT_EQ(trials_of({.initial_damping = 1, .max_damping = 999}), 3);
  EXPECT_EQ(trials_of({.initial_damping = 1e-6, .min_rejected_damping = 1e-2, .max_damping = 0.5}), 3);
  EXPECT_EQ(trials_of({.max_steps = 0}), 0);
}

TEST(LevenbergMarquardt, RejectsACostThatIsNotANumber) {
  const auto cost = [](const Eigen::Vector2d& p) { return p.x() > 0 ? std::nan("") : rosenbrock_cost(p); };
  const Eigen::Vector2d found = minimize_levenberg_marquardt(
      Eigen::Vector2d(-1.2, 1), LevenbergMarquardtOptions{.max_trials = 200, .max_rejections = 30}, rosenbrock_normal,
      cost, sum);
  EXPECT_LE(found.x(), 0);
  EXPECT_LT(rosenbrock_cost(found), rosenbrock_cost({-1.2, 1}));
}

TEST(LevenbergMarquardt, AnEqualCostCountsAsTheRuleSays) {
  const auto flat = [](const Eigen::Vector2d&) { return 1.0; };
  const auto linearize = [](const Eigen::Vector2d&) {
    return Normal{1.0, Eigen::Matrix2d::Identity(), Eigen::Vector2d(1, 0)};
  };
  const Eigen::Vector2d start(0, 0);
  LevenbergMarquardtOptions options{.max_rejections = 3, .initial_damping = 0};
  EXPECT_EQ(minimize_levenberg_marquardt(start, options, linearize, flat, sum), start);
  options.step_rule = StepRule::not_increase;
  EXPECT_EQ(minimize_levenberg_marquardt(start, options, linearize, flat, sum), Eigen::Vector2d(1, 0));
}

// A caller that computes residuals and Jacobians together keeps what cost() computed.
TEST(LevenbergMarquardt, LinearizesTheStateOfTheLatestCost) {
  Eigen::Vector2d latest(-1.2, 1);
  const auto cost = [&](const Eigen::Vector2d& p) {
    latest = p;
    return rosenbrock_cost(p);
  };
  const auto linearize = [&](const Eigen::Vector2d& p) {
    EXPECT_EQ(p, latest);
    return rosenbrock_normal(p);
  };
  minimize_levenberg_marquardt(latest, LevenbergMarquardtOptions{.max_trials = 100}, linearize, cost, sum);
}

}  // namespace
}  // namespace spartan
