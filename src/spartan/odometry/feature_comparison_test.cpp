#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>

#include "spartan/numerics/random.h"
#include "spartan/odometry/view_matching.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;

Image<std::uint8_t> smooth_image(int width, int height) {
  Image<std::uint8_t> image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double gray = 128 + 60 * std::sin(0.09 * x) + 50 * std::cos(0.07 * y + 0.03 * x);
      image(x, y) = static_cast<std::uint8_t>(std::lround(gray));
    }
  }
  return image;
}

TEST(TransformView, MovesGrayLevelsAsItsHomographySays) {
  const Image<std::uint8_t> image = smooth_image(160, 120);
  for (const auto& [degrees, scale] :
       {std::pair(0.0, 1.0), {10.0, 1.0}, {45.0, 1.0}, {90.0, 1.0}, {0.0, 0.7}, {-30.0, 1.5}}) {
    const TransformedView view = transform_view(image.view(), degrees * kDegree, scale);
    for (int y = 10; y < 110; y += 7) {
      for (int x = 10; x < 150; x += 7) {
        const Eigen::Vector3d p = view.geometry.matrix * Eigen::Vector3d(x, y, 1);
        const int u = static_cast<int>(std::floor(p.x())), v = static_cast<int>(std::floor(p.y()));
        ASSERT_TRUE(view.image.contains(u, v) && view.image.contains(u + 1, v + 1));
        const double a = p.x() - u, b = p.y() - v;
        const double gray = (1 - b) * ((1 - a) * view.image(u, v) + a * view.image(u + 1, v)) +
                            b * ((1 - a) * view.image(u, v + 1) + a * view.image(u + 1, v + 1));
        EXPECT_NEAR(gray, image(x, y), 2.0) << degrees << " " << scale;
      }
    }
  }
}

TEST(TransformView, TurnsClockwiseAndHoldsTheWholeImage) {
  Image<std::uint8_t> image(101, 61, 50);
  image(100, 30) = 250;  // at the right
  const TransformedView view = transform_view(image.view(), 90 * kDegree, 1);
  EXPECT_EQ(view.image.size(), (ImageSize{61, 101}));
  EXPECT_GT(view.image(30, 100), 200);  // at the bottom
  const TransformedView half = transform_view(image.view(), 0, 0.5);
  EXPECT_EQ(half.image.size(), (ImageSize{51, 31}));
  EXPECT_THROW(transform_view(image.view(), 0, 0), std::invalid_argument);
  EXPECT_THROW(transform_view(image.view(), 0, 1000), std::invalid_argument);
}

TEST(Homography, IsReadAndRefused) {
  const auto matrix = parse_homography("2 0 10\n0\t2 -4\r\n 0 0 2\n", "h.txt");
  ASSERT_TRUE(matrix.has_value());
  const Eigen::Vector3d p = *matrix * Eigen::Vector3d(3, 5, 1);
  EXPECT_TRUE(p.hnormalized().isApprox(Eigen::Vector2d(8, 3)));
  EXPECT_GT((*parse_homography("-1 0 0 0 -1 0 0 0 -1", "h.txt"))(2, 2), 0) << "the sign of the factor does not count";
  for (const auto& [text, message] : {std::pair("", "has 0 numbers"),
                                      {"1 0 0 0 1 0 0 0", "has 8 numbers"},
                                      {"1 0 0 0 1 0 0 0 1 7", "more than nine"},
                                      {"1 0 0 0 1 0 0 0 x", "'x' is not a number"},
                                      {"1 0 0 0 1 0 0 0 nan", "'nan' is not a number"},
                                      {"1 0 0 0 1 0 1 1 0", "singular"},
                                      {"0 0 0 0 0 0 0 0 0", "singular"},
                                      {"1,0,0 0 1 0 0 0 1", "not a number"}}) {
    const auto refused = parse_homography(text, "h.txt");
    ASSERT_FALSE(refused.has_value()) << text;
    EXPECT_EQ(refused.error().code, ErrorCode::input);
    EXPECT_THAT(refused.error().message(), HasSubstr(message));
  }
}

FeatureComparison points_of(const std::vector<Eigen::Vector2f>& first, const std::vector<Eigen::Vector2f>& second) {
  FeatureComparison c;
  c.first = first;
  c.second = second;
  for (std::size_t i = 0; i < std::min(first.size(), second.size()); ++i)
    c.matches.push_back({static_cast<int>(i), static_cast<int>(i), false});
  return c;
}

TEST(FeatureScores, CountRepeatedFeaturesOnceAndCorrectMatches) {
  ImageRelation shift;
  shift.matrix(0, 2) = 10;
  // The second point is found twice, the third one is 3 px off, the fourth one is not found.
  FeatureComparison c =
      points_of({{10, 10}, {50, 10}, {90, 10}, {90, 90}}, {{20, 10}, {60, 11}, {103, 10}, {60.5F, 9.5F}, {0, 0}});
  score_features(shift, 2, c);
  EXPECT_EQ(c.repeatability, 0.5);
  EXPECT_EQ(c.correct, 2);
  EXPECT_EQ(c.precision, 0.5);
  EXPECT_EQ(c.matching_score, 0.5);
  score_features(shift, 4, c);
  EXPECT_EQ(c.repeatability, 0.75);
  FeatureComparison none;
  score_features(shift, 2, none);
  EXPECT_FALSE(none.repeatability || none.precision || none.matching_score);
}

TEST(FeatureScores, MeasureErrorsInBothImages) {
  ImageRelation twice;
  twice.matrix.diagonal() << 2, 2, 1;
  FeatureComparison c = points_of({{10, 10}}, {{23, 20}});  // 3 px in the second image, 1.5 px in the first one
  score_features(twice, 2, c);
  EXPECT_EQ(c.correct, 0);
  twice.matrix.diagonal() << 0.5, 0.5, 1;
  c = points_of({{10, 10}}, {{6.5F, 5}});  // 1.5 px in the second image, 3 px in the first one
  score_features(twice, 2, c);
  EXPECT_EQ(c.correct, 0);
}

TEST(FeatureScores, KnowOnlyLinesOfARectifiedPair) {
  Eigen::Matrix3d rows;
  rows << 0, 0, 0, 0, 0, -1, 0, 1, 0;
  FeatureComparison c = points_of({{10, 10}, {50, 10}}, {{3, 11}, {50, 14}});
  score_features({ImageRelation::Kind::epipolar, rows}, 2, c);
  EXPECT_EQ(c.correct, 1);
  EXPECT_FALSE(c.repeatability.has_value());
  EXPECT_EQ(c.matching_score, 0.5);
}

// Points at different depths before two cameras, and wrong matches.
TEST(EpipolarGeometry, IsEstimatedInSpiteOfWrongMatches) {
  Random random(4);
  FeatureComparison c;
  const auto pixel = [](const Eigen::Vector3d& p) {
    return Eigen::Vector2f(static_cast<float>(400 * p.x() / p.z() + 320),
                           static_cast<float>(400 * p.y() / p.z() + 240));
  };
  const Eigen::AngleAxisd turn(0.1, Eigen::Vector3d(0.3, 1, 0.2).normalized());
  for (int i = 0; i < 150; ++i) {
    const Eigen::Vector3d p(random.uniform(-2, 2), random.uniform(-1.5, 1.5), random.uniform(3, 9));
    c.first.push_back(pixel(p));
    const bool wrong = i % 3 == 0;
    c.second.push_back(
        wrong ? Eigen::Vector2f(static_cast<float>(random.uniform(0, 640)), static_cast<float>(random.uniform(0, 480)))
              : pixel(turn * p + Eigen::Vector3d(0.5, 0.1, 0.2)));
    c.matches.push_back({i, i, false});
  }
  const auto geometry = estimate_epipolar_geometry(std::span(&c, 1), 1);
  ASSERT_TRUE(geometry.has_value());
  score_features(*geometry, 1, c);
  int right = 0, wrong = 0;
  for (const auto& match : c.matches) (match.first % 3 == 0 ? wrong : right) += match.correct ? 1 : 0;
  EXPECT_EQ(right, 100);
  EXPECT_LT(wrong, 5);
  c.matches.resize(14);
  EXPECT_FALSE(estimate_epipolar_geometry(std::span(&c, 1), 1).has_value());
}

}  // namespace
}  // namespace spartan
