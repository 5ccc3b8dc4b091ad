#include "spartan/odometry/internal/motion/motion_problem.h"

#include <gtest/gtest.h>

#include "spartan/numerics/random.h"

namespace spartan::internal {
namespace {

const RectifiedStereo kProblemStereo{{640, 480}, 500, {319.5, 239.5}, 0.12};

std::vector<LandmarkMatch> random_matches(int count) {
  Random random(3);
  std::vector<LandmarkMatch> matches;
  Vector6d step;
  step << 0.02, -0.01, 0.3, 0.02, -0.03, 0.01;
  for (int i = 0; i < count; ++i) {
    LandmarkMatch m;
    m.point = {{random.uniform(50, 590), random.uniform(50, 430)}, random.uniform(3, 30)};
    m.disparity_variance = 0.04;
    m.previous_from_anchor = exp_se3(random.uniform(0, 1) * step);
    const auto p = project_anchored(kProblemStereo, m.point, m.previous_from_anchor);
    m.measured = p->measured + Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    m.covariance = Eigen::Vector3d(0.5, 0.7, 0.4).asDiagonal();
    m.covariance(0, 1) = m.covariance(1, 0) = 0.1;
    matches.push_back(m);
  }
  return matches;
}

TEST(MotionProblem, GradientIsTheDerivativeOfTheCost) {
  const std::vector<LandmarkMatch> matches = random_matches(40);
  const std::vector<bool> used(matches.size(), true);
  Vector6d moved;
  moved << 0.03, 0.02, -0.05, 0.004, 0.002, -0.003;
  const MotionState state{exp_se3(moved), 0.2};
  for (const bool robust : {true, false}) {
    MotionProblem problem(kProblemStereo, matches, {0.05, 0.02}, robust);
    problem.update_weights(state);
    const auto normal = problem.linearize(used, state, 1.3);
    EXPECT_DOUBLE_EQ(normal.cost, problem.cost(used, state, 1.3));
    for (int k = 0; k < 7; ++k) {
      constexpr double kStep = 1e-6;
      const auto cost_at = [&](double step) {
        Vector7d x = Vector7d::Zero();
        x[k] = step;
        return problem.cost(used, {state.motion * exp_se3(x.head<6>()), state.offset + x[6]}, 1.3);
      };
      // The cost is Σ ρ(r²): its derivative is −2 times the gradient of the normal equations.
      const double numeric = (cost_at(kStep) - cost_at(-kStep)) / (2 * kStep);
      EXPECT_NEAR(numeric, -2 * normal.gradient[k], 1e-4 * std::max(1.0, std::abs(numeric))) << k << " " << robust;
    }
  }
}

// By least squares, an error of all positions moves the estimate by the step of Gauss-Newton that it causes.
TEST(MotionProblem, CovarianceHoldsTheErrorThatAllPositionsShare) {
  std::vector<LandmarkMatch> matches = random_matches(40);
  const std::vector<bool> used(matches.size(), true);
  const MotionState state{Pose::from_translation({0.01, 0, 0.05}), 0};
  const auto problem_of = [&](const std::vector<LandmarkMatch>& of) {
    MotionProblem problem(kProblemStereo, of, {0, 0.02}, false);
    problem.update_weights(state);
    return problem;
  };
  const Matrix7d without = problem_of(matches).covariance(used, state, 1.3);
  for (std::size_t i = 0; i < matches.size(); ++i) matches[i].parallax_px = 500 + 25 * static_cast<double>(i);
  const auto normal = problem_of(matches).linearize(used, state, 1.3);
  Matrix6d expected = Matrix6d::Zero();
  for (const int axis : {0, 1}) {
    std::vector<LandmarkMatch> moved = matches;
    for (LandmarkMatch& match : moved) match.measured[axis] += kSharedViewpointError * match.parallax_px;
    const Vector7d gradient = problem_of(moved).linearize(used, state, 1.3).gradient - normal.gradient;
    const Vector6d step = normal.information.ldlt().solve(gradient).head<6>();
    expected += step * step.transpose();
  }
  const Matrix7d shared = problem_of(matches).covariance(used, state, 1.3) - without;
  EXPECT_GT(expected.norm(), 1e-3 * (without.topLeftCorner<6, 6>().norm()));
  EXPECT_LT((shared.topLeftCorner<6, 6>() - expected).norm(), 1e-6 * expected.norm());
  EXPECT_EQ(shared(6, 6), 0) << "the variance of the disparity offset";
}

TEST(MotionProblem, AgreesWithTheProjectionOfAnchoredPoints) {
  const std::vector<LandmarkMatch> matches = random_matches(20);
  MotionProblem problem(kProblemStereo, matches, {}, true);
  const Pose motion = Pose::from_translation({0.01, 0, 0.05});
  const MotionState state{motion, 0.1};
  problem.update_weights(state);
  const std::vector<double> squares = problem.squares(state);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const LandmarkMatch& m = matches[i];
    const auto p = project_anchored(kProblemStereo, {m.point.pixel, m.point.disparity + 0.1},
                                    motion.inverse() * m.previous_from_anchor);
    const Eigen::Vector3d r = m.measured + Eigen::Vector3d(0, 0, 0.1) - p->measured;
    EXPECT_LT((problem.residual(i, state) - r).norm(), 1e-9);
    const Eigen::Matrix3d s = m.covariance + m.disparity_variance * p->by_disparity * p->by_disparity.transpose();
    EXPECT_NEAR(squares[i], r.dot(s.inverse() * r), 1e-9 * squares[i]);
  }
  // Behind the camera.
  const MotionState beyond{Pose::from_translation({0, 0, 100}), 0};
  for (const double square : problem.squares(beyond)) EXPECT_TRUE(std::isinf(square));
}

}  // namespace
}  // namespace spartan::internal
