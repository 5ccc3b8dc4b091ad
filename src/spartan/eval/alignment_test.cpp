#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "spartan/eval/trajectory_metrics.h"
#include "spartan/numerics/random.h"

namespace spartan {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points random_points(Random& random, int count) {
  Points points;
  for (int i = 0; i < count; ++i) points.emplace_back(10 * random.normal(), 4 * random.normal(), random.normal());
  return points;
}

Eigen::Vector3d random_vector(Random& random, double size) {
  return size * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
}

Points moved(const Similarity& similarity, const Points& points, Random& random, double noise_m) {
  Points result;
  for (const Eigen::Vector3d& p : points) result.push_back(similarity * p + random_vector(random, noise_m));
  return result;
}

double sum_of_squares(const Similarity& similarity, const Points& source, const Points& target) {
  double sum = 0;
  for (std::size_t i = 0; i < source.size(); ++i) sum += (similarity * source[i] - target[i]).squaredNorm();
  return sum;
}

void expect_same(const Similarity& a, const Similarity& b, double tolerance) {
  EXPECT_NEAR(a.scale, b.scale, tolerance);
  EXPECT_LE((a.pose.matrix() - b.pose.matrix()).cwiseAbs().maxCoeff(), tolerance);
}

TEST(Alignment, RecoversTheAppliedTransform) {
  Random random(1);
  for (int n = 0; n < 50; ++n) {
    const Points source = random_points(random, 3 + n);
    const Pose pose(exp_so3(random_vector(random, 1.5)), random_vector(random, 20));
    const double scale = random.uniform(0.1, 5);
    expect_same(fit_similarity(source, moved({scale, pose}, source, random, 0), true), {scale, pose}, 1e-9);
    expect_same(fit_similarity(source, moved({1, pose}, source, random, 0), false), {1, pose}, 1e-9);
    const Similarity turned{1, Pose(exp_so3({0, 0, random.uniform(-3.1, 3.1)}), random_vector(random, 20))};
    expect_same(fit_yaw(source, moved(turned, source, random, 0)), turned, 1e-9);
  }
}

// The sum of squares must rise in every direction of the fitted parameters.
TEST(Alignment, MinimizesTheSumOfSquares) {
  Random random(2);
  for (int n = 0; n < 20; ++n) {
    const Points source = random_points(random, 12);
    const Points target = moved({1.7, Pose(exp_so3(random_vector(random, 1)), {3, 4, 5})}, source, random, 0.5);
    const Similarity se3 = fit_similarity(source, target, false), sim3 = fit_similarity(source, target, true),
                     yaw = fit_yaw(source, target);
    const double se3_sum = sum_of_squares(se3, source, target), sim3_sum = sum_of_squares(sim3, source, target),
                 yaw_sum = sum_of_squares(yaw, source, target);
    EXPECT_LT(sim3_sum, se3_sum);
    EXPECT_LT(se3_sum, yaw_sum);
    for (int k = 0; k < 12; ++k) {
      Vector6d step = Vector6d::Zero();
      step[k % 6] = k < 6 ? 1e-3 : -1e-3;
      EXPECT_GT(sum_of_squares({1, exp_se3(step) * se3.pose}, source, target), se3_sum);
      EXPECT_GT(sum_of_squares({sim3.scale, exp_se3(step) * sim3.pose}, source, target), sim3_sum);
      if (k % 6 == 3 || k % 6 == 4) continue;  // roll and pitch are not fitted
      EXPECT_GT(sum_of_squares({1, exp_se3(step) * yaw.pose}, source, target), yaw_sum);
    }
    for (const double factor : {0.999, 1.001}) {
      EXPECT_GT(sum_of_squares({factor * sim3.scale, sim3.pose}, source, target), sim3_sum);
    }
  }
}

TEST(Alignment, NeverReflects) {
  Random random(3);
  const Points source = random_points(random, 30);
  Points mirrored = source;
  for (Eigen::Vector3d& p : mirrored) p.x() = -p.x();
  const Similarity fitted = fit_similarity(source, mirrored, true);
  EXPECT_NEAR(fitted.pose.rotation_matrix().determinant(), 1.0, 1e-9);
  EXPECT_GT(fitted.scale, 0);
}

TEST(Alignment, FitsCollinearAndCoincidentPoints) {
  Random random(4);
  const Similarity applied{1, Pose(exp_so3({0.3, -0.8, 0.5}), {1, 2, 3})};
  Points line;
  for (int i = 0; i < 10; ++i) line.emplace_back(i, 2.0 * i, -0.5 * i);
  const Points target = moved(applied, line, random, 0);
  EXPECT_LE(sum_of_squares(fit_similarity(line, target, false), line, target), 1e-18);
  const Points coincident(5, Eigen::Vector3d(1, 1, 1)), elsewhere(5, Eigen::Vector3d(4, 5, 6));
  for (const bool with_scale : {false, true}) {
    const Similarity fitted = fit_similarity(coincident, elsewhere, with_scale);
    EXPECT_EQ(fitted.scale, 1.0);
    EXPECT_LE(sum_of_squares(fitted, coincident, elsewhere), 1e-18);
  }
  EXPECT_LE(sum_of_squares(fit_yaw(coincident, elsewhere), coincident, elsewhere), 1e-18);
}

TEST(Alignment, AlignsTheFirstPoses) {
  const Trajectory estimate{{{}, Pose(exp_so3({0.1, 0.2, 0.3}), {1, 2, 3})}, {{1}, Pose()}};
  const Trajectory truth{{{}, Pose(exp_so3({-0.4, 0, 1}), {7, 8, 9})}, {{1}, Pose()}};
  const Similarity fitted = align(estimate, truth, Alignment::first);
  EXPECT_LE(((fitted * estimate[0].pose).matrix() - truth[0].pose.matrix()).norm(), 1e-12);
}

TEST(Alignment, NamesAreUniqueAndCountsAreChecked) {
  for (const Alignment a : {Alignment::none, Alignment::first, Alignment::yaw, Alignment::se3, Alignment::sim3}) {
    EXPECT_EQ(alignment_named(name_of(a)), a);
  }
  EXPECT_EQ(alignment_named("se4"), std::nullopt);
  EXPECT_THROW(fit_similarity({}, {}, true), std::invalid_argument);
  EXPECT_THROW(fit_yaw({Eigen::Vector3d::Zero()}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace spartan
