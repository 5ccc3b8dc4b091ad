#include "spartan/odometry/rigid_fit.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "spartan/core/random.h"

namespace spartan {
namespace {

std::vector<Eigen::Vector3d> cloud(Random& random, int count) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) {
    points.emplace_back(random.uniform(-2, 2), random.uniform(-1, 1), random.uniform(2, 9));
  }
  return points;
}

std::vector<Eigen::Vector3d> moved(const Pose& pose, std::vector<Eigen::Vector3d> points) {
  for (Eigen::Vector3d& p : points) p = pose * p;
  return points;
}

RC_GTEST_PROP(RigidFit, FindsAnyMotionOfThreeOrMorePoints, (std::uint32_t seed)) {
  Random random(seed);
  Vector6d tangent;
  for (int i = 0; i < 6; ++i) tangent[i] = random.uniform(-1.5, 1.5);
  const Pose a_from_b = exp_se3(tangent);
  const std::vector<Eigen::Vector3d> b = cloud(random, 3 + static_cast<int>(random.below(10)));
  const auto fit = fit_rigid(moved(a_from_b, b), b, std::vector<double>(b.size(), 1.0));
  RC_ASSERT(fit.has_value());
  // Three points that nearly lie on a line leave a turn about it almost free.
  for (const Eigen::Vector3d& p : b) RC_ASSERT((*fit * p - a_from_b * p).norm() < 1e-5);
}

TEST(RigidFit, WeighsThePoints) {
  Random random(1);
  std::vector<Eigen::Vector3d> b = cloud(random, 10);
  const Pose a_from_b = exp_se3((Vector6d() << 0.3, -0.1, 0.8, 0.02, 0.3, -0.1).finished());
  std::vector<Eigen::Vector3d> a = moved(a_from_b, b);
  a[4] += Eigen::Vector3d(1, 1, 1);
  std::vector<double> weights(10, 1.0);
  EXPECT_GT(log_se3(a_from_b.inverse() * *fit_rigid(a, b, weights)).norm(), 0.01);
  weights[4] = 0;
  EXPECT_LT(log_se3(a_from_b.inverse() * *fit_rigid(a, b, weights)).norm(), 1e-9);
}

TEST(RigidFit, NeverMirrors) {
  Random random(2);
  const std::vector<Eigen::Vector3d> b = cloud(random, 8);
  std::vector<Eigen::Vector3d> a = b;
  for (Eigen::Vector3d& p : a) p.x() = -p.x();
  const auto fit = fit_rigid(a, b, std::vector<double>(8, 1.0));
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->rotation_matrix().determinant(), 1, 1e-12);
}

TEST(RigidFit, RefusesTooFewPointsAndPointsOnALine) {
  const std::vector<Eigen::Vector3d> two{{0, 0, 1}, {1, 0, 2}};
  EXPECT_FALSE(fit_rigid(two, two, {1, 1}).has_value());
  const std::vector<Eigen::Vector3d> line{{0, 0, 1}, {0.5, 0, 2}, {1, 0, 3}, {2, 0, 5}};
  EXPECT_FALSE(fit_rigid(line, line, {1, 1, 1, 1}).has_value());
  const std::vector<Eigen::Vector3d> same(4, Eigen::Vector3d(1, 2, 3));
  EXPECT_FALSE(fit_rigid(same, same, {1, 1, 1, 1}).has_value());
  EXPECT_FALSE(fit_rigid(line, line, {0, 0, 0, 0}).has_value());
}

}  // namespace
}  // namespace spartan
