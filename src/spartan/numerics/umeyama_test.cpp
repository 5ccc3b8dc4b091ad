#include "spartan/numerics/umeyama.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Geometry>
#include <vector>

#include "spartan/numerics/random.h"

namespace spartan {
namespace {

using Points = std::vector<Eigen::Vector3d>;

Points random_points(Random& random, int count) {
  Points points;
  for (int i = 0; i < count; ++i) {
    points.emplace_back(random.uniform(-2, 2), random.uniform(-1, 1), random.uniform(2, 9));
  }
  return points;
}

Points transformed(const Similarity& similarity, Points points) {
  for (Eigen::Vector3d& p : points) p = similarity * p;
  return points;
}

Pose random_pose(Random& random) {
  Vector6d tangent;
  for (int i = 0; i < 6; ++i) tangent[i] = random.uniform(-1.5, 1.5);
  return exp_se3(tangent);
}

Eigen::Matrix3Xd to_columns(const Points& points) {
  Eigen::Matrix3Xd columns(3, static_cast<Eigen::Index>(points.size()));
  for (std::size_t i = 0; i < points.size(); ++i) columns.col(static_cast<Eigen::Index>(i)) = points[i];
  return columns;
}

Eigen::Matrix4d to_matrix(const Similarity& similarity) {
  Eigen::Matrix4d matrix = similarity.pose.matrix();
  matrix.topLeftCorner<3, 3>() *= similarity.scale;
  return matrix;
}

RC_GTEST_PROP(Umeyama, RecoversAnyTransformOfThreeOrMorePoints, (std::uint32_t seed)) {
  Random random(seed);
  const Points source = random_points(random, 3 + static_cast<int>(random.below(10)));
  const Similarity rigid{1, random_pose(random)}, similarity{random.uniform(0.1, 5), rigid.pose};
  const auto with_scale = fit_umeyama(transformed(similarity, source), source, FitScale::estimated);
  const auto without = fit_umeyama(transformed(rigid, source), source, FitScale::fixed);
  RC_ASSERT(with_scale && without);
  RC_ASSERT(without->target_from_source.scale == 1.0);
  // Three nearly collinear points leave the rotation about their line almost free, so the points are compared.
  for (const Eigen::Vector3d& p : source) {
    RC_ASSERT((with_scale->target_from_source * p - similarity * p).norm() < 1e-4);
    RC_ASSERT((without->target_from_source * p - rigid * p).norm() < 1e-5);
  }
}

TEST(Umeyama, AgreesWithEigenOnNoisyPoints) {
  Random random(2);
  for (int n = 0; n < 50; ++n) {
    const Points source = random_points(random, 4 + n);
    Points target = transformed({random.uniform(0.2, 4), random_pose(random)}, source);
    for (Eigen::Vector3d& p : target) p += Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    for (const bool with_scale : {false, true}) {
      const auto fit = fit_umeyama(target, source, with_scale ? FitScale::estimated : FitScale::fixed);
      ASSERT_TRUE(fit.has_value());
      EXPECT_TRUE(fit->unique);
      const Eigen::Matrix4d expected = Eigen::umeyama(to_columns(source), to_columns(target), with_scale);
      EXPECT_LT((to_matrix(fit->target_from_source) - expected).norm(), 1e-9);
    }
  }
}

// A pair of points of weight k counts like k pairs of weight 1, so Eigen's unweighted fit is an oracle for weights,
// too.
TEST(Umeyama, AWeightIsAMultiplicity) {
  Random random(3);
  const Points source = random_points(random, 12);
  Points target = transformed({2, random_pose(random)}, source);
  for (Eigen::Vector3d& p : target) p += 0.3 * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
  std::vector<double> weights;
  Points repeated_source, repeated_target;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const std::size_t multiplicity = i % 4;
    weights.push_back(0.25 * static_cast<double>(multiplicity));
    repeated_source.insert(repeated_source.end(), multiplicity, source[i]);
    repeated_target.insert(repeated_target.end(), multiplicity, target[i]);
  }
  const auto fit = fit_umeyama(target, source, FitScale::estimated, weights);
  ASSERT_TRUE(fit.has_value());
  const Eigen::Matrix4d expected = Eigen::umeyama(to_columns(repeated_source), to_columns(repeated_target), true);
  EXPECT_LT((to_matrix(fit->target_from_source) - expected).norm(), 1e-9);
}

TEST(Umeyama, EqualWeightsGiveTheBitsOfTheUnweightedFit) {
  Random random(4);
  const Points source = random_points(random, 9), target = random_points(random, 9);
  const auto plain = fit_umeyama(target, source, FitScale::estimated);
  const auto ones = fit_umeyama(target, source, FitScale::estimated, std::vector<double>(9, 1.0));
  ASSERT_TRUE(plain && ones);
  EXPECT_EQ(to_matrix(plain->target_from_source), to_matrix(ones->target_from_source));
}

TEST(Umeyama, NeverReflects) {
  Random random(5);
  const Points source = random_points(random, 8);
  Points mirrored = source;
  for (Eigen::Vector3d& p : mirrored) p.x() = -p.x();
  for (const FitScale scale : {FitScale::fixed, FitScale::estimated}) {
    const auto fit = fit_umeyama(mirrored, source, scale);
    ASSERT_TRUE(fit.has_value());
    EXPECT_NEAR(fit->target_from_source.pose.rotation_matrix().determinant(), 1, 1e-12);
    EXPECT_GT(fit->target_from_source.scale, 0);
  }
}

TEST(Umeyama, ReportsDegenerateConfigurations) {
  const Points line{{0, 0, 1}, {0.5, 0, 2}, {1, 0, 3}, {2, 0, 5}};
  const auto on_a_line = fit_umeyama(line, line, FitScale::fixed);
  ASSERT_TRUE(on_a_line.has_value());
  EXPECT_FALSE(on_a_line->unique);
  for (const Eigen::Vector3d& p : line) EXPECT_LT((on_a_line->target_from_source * p - p).norm(), 1e-9);
  const Points one_place(4, Eigen::Vector3d(1, 2, 3));
  const auto at_one_place = fit_umeyama(one_place, one_place, FitScale::estimated);
  ASSERT_TRUE(at_one_place.has_value());
  EXPECT_FALSE(at_one_place->unique);
  EXPECT_EQ(at_one_place->target_from_source.scale, 1.0);
  EXPECT_FALSE(fit_umeyama({}, {}, FitScale::fixed).has_value());
  EXPECT_FALSE(fit_umeyama(line, line, FitScale::fixed, std::vector<double>(4, 0.0)).has_value());
}

TEST(Umeyama, ThrowsWhereCountsDiffer) {
  const Points three(3, Eigen::Vector3d::Zero()), two(2, Eigen::Vector3d::Zero());
  EXPECT_THROW(fit_umeyama(three, two, FitScale::fixed), std::invalid_argument);
  EXPECT_THROW(fit_umeyama(three, three, FitScale::fixed, std::vector<double>(2, 1.0)), std::invalid_argument);
}

}  // namespace
}  // namespace spartan
