#include "spartan/rig/design/stereo_relations.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <numbers>

namespace spartan {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
const StereoShape kWide{0.20, 1120, 50 * kDegree};
const StereoShape kNarrow{0.12, 640, 66 * kDegree};
const DepthAccuracy kAsked{0.02, 0.3};

// A number of [low, high] with three digits behind the point.
double some(double low, double high) {
  return 0.001 * *rc::gen::inRange(static_cast<int>(1000 * low), static_cast<int>(1000 * high) + 1);
}
StereoShape some_shape() {
  return {some(0.05, 1), some(100, 4000), some(5, 150) * kDegree};
}
bool near(double a, double b, double relative = 1e-12) {
  return std::abs(a - b) <= relative * std::max(std::abs(a), std::abs(b));
}

TEST(StereoRelations, GiveThePublishedFigures) {
  EXPECT_NEAR(focal_length_px(1120, 50 * kDegree), 1200.9239, 1e-4);
  EXPECT_NEAR(focal_length_mm(5.5, 1120, 50 * kDegree), 6.6, 0.05);
  EXPECT_NEAR(reach_m(kWide, kAsked), 4.00, 0.005);
  EXPECT_NEAR(reach_m(kNarrow, kAsked), 1.99, 0.005);
  EXPECT_NEAR(reach_m({0.12, 1024, 66 * kDegree}, kAsked), 2.51, 0.005);
  EXPECT_NEAR(accuracy_for_reach_px(kNarrow, 0.02, 2.5), 0.19, 0.005);
  EXPECT_NEAR(stereo_angle_rad(0.20, 1.0) / kDegree, 11.4, 0.05);
  EXPECT_NEAR(search_percent(stereo_angle_rad(0.20, 1.0), 50 * kDegree), 22.8, 0.05);
  EXPECT_NEAR(overlap_percent(50 * kDegree, 35 * kDegree), 30, 1e-9);
  EXPECT_NEAR(ground_ahead_m(1.0, 64 * kDegree), 0.488, 0.0005);
  EXPECT_NEAR(ground_ahead_m(1.0, 14 * kDegree), 4.011, 0.0005);
  EXPECT_NEAR(ground_ahead_m(0.30, (31.55 + 24.75) * kDegree), 0.200, 0.0005);
  EXPECT_NEAR(ground_ahead_m(0.30, (31.55 - 24.75) * kDegree), 2.516, 0.0005);
  EXPECT_NEAR(vertical_view_rad(66 * kDegree, 0.75) / kDegree, 51.9, 0.05);
}

// A point at the border of the picture, projected.
RC_GTEST_PROP(StereoRelations, TheFocalLengthPutsTheBorderOfTheViewOnTheBorderOfTheImage, ()) {
  const StereoShape shape = some_shape();
  const double f = focal_length_px(shape.width_px, shape.hfov_rad), depth = some(0.5, 20);
  const double aside = depth * std::tan(shape.hfov_rad / 2);
  RC_ASSERT(near(f * aside / depth, shape.width_px / 2));
  RC_ASSERT(near(focal_length_mm(5, shape.width_px, shape.hfov_rad), f * 0.005));
  const double rows_per_column = some(0.2, 2);
  RC_ASSERT(
      near(f * std::tan(vertical_view_rad(shape.hfov_rad, rows_per_column) / 2), rows_per_column * shape.width_px / 2));
}

// Two eyes look at a point, and at one a hair nearer; the derivative is taken by differences.
RC_GTEST_PROP(StereoRelations, AStepOfDisparityIsWorthTheRangeResolution, ()) {
  const StereoShape shape = some_shape();
  const double depth = some(0.5, 20), c = some(0.05, 1), nearer = depth * (1 - 1e-6);
  const double step_px = disparity_px(shape, nearer) - disparity_px(shape, depth);
  RC_ASSERT(near((depth - nearer) * c / step_px, range_resolution_m(shape, c, depth), 1e-5));
  // Similar triangles: what is `baseline` aside at that depth is `disparity` aside in the picture.
  RC_ASSERT(
      near(focal_length_px(shape.width_px, shape.hfov_rad) * shape.baseline_m / depth, disparity_px(shape, depth)));
}

RC_GTEST_PROP(StereoRelations, TheReachIsWhereTheResolutionIsUsedUp, ()) {
  const StereoShape shape = some_shape();
  const DepthAccuracy accuracy{some(0.001, 0.5), some(0.05, 2)};
  const double reach = reach_m(shape, accuracy);
  RC_ASSERT(near(range_resolution_m(shape, accuracy.disparity_px, reach), accuracy.resolution_m));
  RC_ASSERT(range_resolution_m(shape, accuracy.disparity_px, 1.01 * reach) > accuracy.resolution_m);
  RC_ASSERT(near(accuracy_for_reach_px(shape, accuracy.resolution_m, reach), accuracy.disparity_px));
  RC_ASSERT(near(width_for_reach_px(shape, accuracy, reach), shape.width_px));
}

RC_GTEST_PROP(StereoRelations, TheStereoAngleIsThatBetweenTheLinesOfSight, ()) {
  const double baseline = some(0.05, 2), nearest = some(0.1, 10);
  const Eigen::Vector2d left(baseline / 2, nearest), right(-baseline / 2, nearest);
  const double angle = std::acos(left.normalized().dot(right.normalized()));
  RC_ASSERT(near(stereo_angle_rad(baseline, nearest), angle, 1e-6));
  RC_ASSERT(near(search_percent(angle, 2 * angle), 50));
}

// A ray walked down to the plane z = 0.
RC_GTEST_PROP(StereoRelations, TheGroundIsWhereTheLineOfSightHasComeDown, ()) {
  const double height = some(0.1, 5), down = some(0.5, 150) * kDegree, range = some(0.5, 30),
               view = some(5, 80) * kDegree;
  const double ahead = ground_ahead_m(height, down), length = std::hypot(ahead, height);
  RC_ASSERT(std::abs(height - length * std::sin(down)) < 1e-9);
  RC_ASSERT(std::abs(ahead - length * std::cos(down)) < 1e-9);
  RC_ASSERT(near(ground_ahead_m(height, tilt_to_reach_rad(height, range, view) - view / 2), range, 1e-9));
}

TEST(StereoRelations, TheSkyIsEndlesslyFar) {
  EXPECT_EQ(ground_ahead_m(1, 0), std::numeric_limits<double>::infinity());
  EXPECT_EQ(ground_ahead_m(1, -0.1), std::numeric_limits<double>::infinity());
  EXPECT_LT(overlap_percent(30 * kDegree, 35 * kDegree), 0) << "a gap";
}

}  // namespace
}  // namespace spartan
