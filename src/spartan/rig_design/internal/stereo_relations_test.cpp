#include "spartan/rig_design/internal/stereo_relations.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>

#include "spartan/core/pose.h"

namespace spartan::internal {
namespace {

const StereoGeometry kWide{0.20, 1120, 50 * kRadiansPerDegree};
const StereoGeometry kNarrow{0.12, 640, 66 * kRadiansPerDegree};
const DepthAccuracy kRequired{0.02, 0.3};

// A random number in [low, high] with three decimals.
double random_in(double low, double high) {
  return 0.001 * *rc::gen::inRange(static_cast<int>(1000 * low), static_cast<int>(1000 * high) + 1);
}
StereoGeometry random_pair() {
  return {random_in(0.05, 1), random_in(100, 4000), random_in(5, 150) * kRadiansPerDegree};
}
bool near(double a, double b, double relative = 1e-12) {
  return std::abs(a - b) <= relative * std::max(std::abs(a), std::abs(b));
}

TEST(StereoRelations, ReproduceThePublishedValues) {
  EXPECT_NEAR(focal_length_px(1120, 50 * kRadiansPerDegree), 1200.9239, 1e-4);
  EXPECT_NEAR(focal_length_mm(5.5, 1120, 50 * kRadiansPerDegree), 6.6, 0.05);
  EXPECT_NEAR(max_range_m(kWide, kRequired), 4.00, 0.005);
  EXPECT_NEAR(max_range_m(kNarrow, kRequired), 1.99, 0.005);
  EXPECT_NEAR(max_range_m({0.12, 1024, 66 * kRadiansPerDegree}, kRequired), 2.51, 0.005);
  EXPECT_NEAR(accuracy_for_range_px(kNarrow, 0.02, 2.5), 0.19, 0.005);
  EXPECT_NEAR(stereo_angle_rad(0.20, 1.0) / kRadiansPerDegree, 11.4, 0.05);
  EXPECT_NEAR(search_percent(stereo_angle_rad(0.20, 1.0), 50 * kRadiansPerDegree), 22.8, 0.05);
  EXPECT_NEAR(overlap_percent(50 * kRadiansPerDegree, 35 * kRadiansPerDegree), 30, 1e-9);
  EXPECT_NEAR(ground_ahead_m(1.0, 64 * kRadiansPerDegree), 0.488, 0.0005);
  EXPECT_NEAR(ground_ahead_m(1.0, 14 * kRadiansPerDegree), 4.011, 0.0005);
  EXPECT_NEAR(ground_ahead_m(0.30, (31.55 + 24.75) * kRadiansPerDegree), 0.200, 0.0005);
  EXPECT_NEAR(ground_ahead_m(0.30, (31.55 - 24.75) * kRadiansPerDegree), 2.516, 0.0005);
  EXPECT_NEAR(vertical_view_rad(66 * kRadiansPerDegree, 0.75) / kRadiansPerDegree, 51.9, 0.05);
}

// Projects a point at the image border.
RC_GTEST_PROP(StereoRelations, FocalLengthProjectsTheFieldOfViewOntoTheImage, ()) {
  const StereoGeometry pair = random_pair();
  const double f = focal_length_px(pair.width_px, pair.hfov_rad), depth = random_in(0.5, 20);
  const double aside = depth * std::tan(pair.hfov_rad / 2);
  RC_ASSERT(near(f * aside / depth, pair.width_px / 2));
  RC_ASSERT(near(focal_length_mm(5, pair.width_px, pair.hfov_rad), f * 0.005));
  const double rows_per_column = random_in(0.2, 2);
  RC_ASSERT(
      near(f * std::tan(vertical_view_rad(pair.hfov_rad, rows_per_column) / 2), rows_per_column * pair.width_px / 2));
}

// Numerical derivative of depth by disparity.
RC_GTEST_PROP(StereoRelations, RangeResolutionIsTheDerivative, ()) {
  const StereoGeometry pair = random_pair();
  const double depth = random_in(0.5, 20), c = random_in(0.05, 1), nearer = depth * (1 - 1e-6);
  const double step_px = disparity_px(pair, nearer) - disparity_px(pair, depth);
  RC_ASSERT(near((depth - nearer) * c / step_px, range_resolution_m(pair, c, depth), 1e-5));
  // Similar triangles: a lateral offset of `baseline` at that depth projects to `disparity`.
  RC_ASSERT(near(focal_length_px(pair.width_px, pair.hfov_rad) * pair.baseline_m / depth, disparity_px(pair, depth)));
}

RC_GTEST_PROP(StereoRelations, MaxRangeIsWhereTheResolutionIsReached, ()) {
  const StereoGeometry pair = random_pair();
  const DepthAccuracy accuracy{random_in(0.001, 0.5), random_in(0.05, 2)};
  const double range = max_range_m(pair, accuracy);
  RC_ASSERT(near(range_resolution_m(pair, accuracy.disparity_px, range), accuracy.resolution_m));
  RC_ASSERT(range_resolution_m(pair, accuracy.disparity_px, 1.01 * range) > accuracy.resolution_m);
  RC_ASSERT(near(accuracy_for_range_px(pair, accuracy.resolution_m, range), accuracy.disparity_px));
  RC_ASSERT(near(width_for_range_px(pair, accuracy, range), pair.width_px));
}

RC_GTEST_PROP(StereoRelations, StereoAngleIsTheAngleBetweenTheRays, ()) {
  const double baseline = random_in(0.05, 2), nearest = random_in(0.1, 10);
  const Eigen::Vector2d left(baseline / 2, nearest), right(-baseline / 2, nearest);
  const double angle = std::acos(left.normalized().dot(right.normalized()));
  RC_ASSERT(near(stereo_angle_rad(baseline, nearest), angle, 1e-6));
  RC_ASSERT(near(search_percent(angle, 2 * angle), 50));
}

// A ray intersected with the plane z = 0.
RC_GTEST_PROP(StereoRelations, GroundDistanceIsTheRayIntersection, ()) {
  const double height = random_in(0.1, 5), down = random_in(0.5, 150) * kRadiansPerDegree, range = random_in(0.5, 30),
               view = random_in(5, 80) * kRadiansPerDegree;
  const double ahead = ground_ahead_m(height, down), length = std::hypot(ahead, height);
  RC_ASSERT(std::abs(height - length * std::sin(down)) < 1e-9);
  RC_ASSERT(std::abs(ahead - length * std::cos(down)) < 1e-9);
  RC_ASSERT(near(ground_ahead_m(height, tilt_to_reach_rad(height, range, view) - view / 2), range, 1e-9));
}

TEST(StereoRelations, HorizonIsInfinitelyFar) {
  EXPECT_EQ(ground_ahead_m(1, 0), std::numeric_limits<double>::infinity());
  EXPECT_EQ(ground_ahead_m(1, -0.1), std::numeric_limits<double>::infinity());
  EXPECT_LT(overlap_percent(30 * kRadiansPerDegree, 35 * kRadiansPerDegree), 0) << "a gap";
}

}  // namespace
}  // namespace spartan::internal
