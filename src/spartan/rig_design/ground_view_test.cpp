#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "spartan/core/pose.h"
#include "spartan/rig/rig.h"
#include "spartan/rig_design/rig_designer.h"
#include "spartan/testing/real_data.h"

namespace spartan {
namespace {

const GroundView kWide{1.0, 39 * kRadiansPerDegree, 50 * kRadiansPerDegree, 50 * kRadiansPerDegree, 0.20};
const GroundView kNarrow{0.30, 31.55 * kRadiansPerDegree, 66 * kRadiansPerDegree, 49.5 * kRadiansPerDegree, 0.12};

double random_in(double low, double high) {
  return low + (high - low) * 1e-6 * *rc::gen::inRange(0, 1'000'001);
}

// Independent reference: the camera models and mounts of the shipped rig.
const Rig& rover() {
  static const Rig rig = read_rig_yaml(testing::source_folder() + "/config/rigs/rover.yaml").value();
  return rig;
}
Pose body_from(const std::string& camera, double pan_rad) {
  const bool on_mast = rover().find_camera(camera)->mount == "mast";
  return on_mast ? rover().body_from_camera(camera, pan_rad, 39 * kRadiansPerDegree) : rover().body_from_camera(camera);
}

// Intersection of the ray of a pixel with the ground.
Eigen::Vector2d on_ground(const std::string& camera, double pan_rad, const Eigen::Vector2d& pixel) {
  const Pose body_from_camera = body_from(camera, pan_rad);
  const Ray ray = unproject(rover().find_camera(camera)->model, pixel).value();
  const Eigen::Vector3d d = body_from_camera.rotation() * ray.direction;
  const Eigen::Vector3d& from = body_from_camera.translation();
  return (from - d * (from.z() / d.z())).head<2>();
}

// Distance of a ground point from the image border, px; negative outside of the image.
double border_distance_px(const std::string& camera, double pan_rad, const Eigen::Vector2d& ground) {
  const Camera& c = *rover().find_camera(camera);
  const Pose camera_from_body = body_from(camera, pan_rad).inverse();
  const auto pixel = project(c.model, camera_from_body * Eigen::Vector3d(ground.x(), ground.y(), 0));
  if (!pixel) return -1e9;
  return std::min(
      {pixel->x() + 0.5, c.size.width - 0.5 - pixel->x(), pixel->y() + 0.5, c.size.height - 0.5 - pixel->y()});
}

bool contains(const GroundPolygon& polygon, const Eigen::Vector2d& p) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d& a = polygon[i];
    const Eigen::Vector2d u = polygon[(i + 1) % polygon.size()] - a, v = p - a;
    if (u.x() * v.y() - u.y() * v.x() < 0) return false;
  }
  return !polygon.empty();
}

void expect_corners(const GroundView& view, const std::string& pair, double pan_rad) {
  for (const auto& [side, left_m] :
       {std::pair{"_left", view.baseline_m / 2}, std::pair{"_right", -view.baseline_m / 2}}) {
    const std::string camera = pair + side;
    const ImageSize size = rover().find_camera(camera)->size;
    const GroundPolygon corners = footprint(view, left_m, pan_rad);
    const double right = size.width - 0.5, low = size.height - 0.5;
    const Eigen::Vector2d pixels[] = {{right, low}, {right, -0.5}, {-0.5, -0.5}, {-0.5, low}};
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_LT((corners[i] - on_ground(camera, pan_rad, pixels[i])).norm(), 1e-5) << camera << " corner " << i;
    }
  }
}

TEST(GroundView, CornersAgreeWithTheShippedRig) {
  for (const double pan_deg : {-35.0, 0.0, 35.0}) expect_corners(kWide, "wide", pan_deg * kRadiansPerDegree);
  expect_corners(kNarrow, "narrow", 0);
}

// Points all around: in the polygon exactly where both cameras of the shipped rig have them in the image.
RC_GTEST_PROP(GroundView, CommonFootprintIsWhatBothCamerasSee, (bool wide)) {
  const double pan = wide ? random_in(-60, 60) * kRadiansPerDegree : 0;
  const Eigen::Vector2d p(random_in(-2, 5), random_in(-5, 5));
  const std::string name = wide ? "wide" : "narrow";
  const double inside =
      std::min(border_distance_px(name + "_left", pan, p), border_distance_px(name + "_right", pan, p));
  RC_PRE(std::abs(inside) > 1e-2);  // the rig's focal lengths have seven digits
  RC_ASSERT(contains(common_footprint(wide ? kWide : kNarrow, pan), p) == (inside > 0));
}

TEST(GroundView, PublishedValuesOfTheFarEdge) {
  const GroundPolygon one_camera = footprint(kWide, 0, 0), both = common_footprint(kWide, 0);
  EXPECT_NEAR(far_edge_half_azimuth_rad(one_camera).value() / kRadiansPerDegree, 23.54, 0.005);
  EXPECT_NEAR(one_camera[1].norm(), 4.37, 0.006);
  EXPECT_NEAR(2 * (35 + far_edge_half_azimuth_rad(both).value() / kRadiansPerDegree), 114.6, 0.05);
  EXPECT_NEAR(near_edge_m(kWide), 0.488, 0.0005);
  EXPECT_NEAR(far_edge_m(kNarrow), 2.516, 0.0005);
  // From the pixels: the left corner of the right camera limits the common footprint on the left.
  const Eigen::Vector2d corner = on_ground("wide_right", 0, {-0.5, -0.5});
  EXPECT_NEAR(far_edge_half_azimuth_rad(both).value(), std::atan2(corner.y(), corner.x()), 1e-6);
}

GroundPolygon rectangle(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

RC_GTEST_PROP(GroundView, RectanglesIntersectInARectangle, ()) {
  const auto sorted = [] {
    const double a = random_in(0, 10), b = random_in(0, 10);
    return std::pair{std::min(a, b), std::max(a, b)};
  };
  const auto [ax0, ax1] = sorted();
  const auto [ay0, ay1] = sorted();
  const auto [bx0, bx1] = sorted();
  const auto [by0, by1] = sorted();
  const double wide = std::max(0.0, std::min(ax1, bx1) - std::max(ax0, bx0));
  const double high = std::max(0.0, std::min(ay1, by1) - std::max(ay0, by0));
  const GroundPolygon common = intersection(rectangle(ax0, ay0, ax1, ay1), rectangle(bx0, by0, bx1, by1));
  RC_ASSERT(std::abs(area_m2(common) - wide * high) < 1e-9);
  RC_ASSERT(common.empty() == (area_m2(common) <= 0));
}

RC_GTEST_PROP(GroundView, IntersectionLiesInBothFootprints, ()) {
  const GroundPolygon a = common_footprint(kWide, random_in(-40, 0) * kRadiansPerDegree),
                      b = common_footprint(kWide, random_in(0, 40) * kRadiansPerDegree);
  const GroundPolygon common = intersection(a, b);
  RC_ASSERT(area_m2(common) <= std::min(area_m2(a), area_m2(b)) + 1e-12);
  RC_ASSERT(std::abs(area_m2(common) - area_m2(intersection(b, a))) < 1e-9);
  const Eigen::Vector2d p(random_in(-1, 5), random_in(-4, 4));
  RC_ASSERT(contains(common, p) == (contains(a, p) && contains(b, p)));
}

// Footprints ahead of the rover, around it (the bottom row points backwards), and with many corners.
RC_GTEST_PROP(GroundView, AzimuthsAgreeWithPointInPolygon, (bool around)) {
  GroundView view = kWide;
  if (around) view.tilt_rad = random_in(70, 90) * kRadiansPerDegree;
  GroundPolygon polygon = common_footprint(view, random_in(-180, 180) * kRadiansPerDegree);
  if (!around) polygon = intersection(polygon, common_footprint(view, random_in(-180, 180) * kRadiansPerDegree));
  const double azimuth = random_in(-180, 180) * kRadiansPerDegree, r = random_in(0, 6);
  const auto at = [&](double a) { return Eigen::Vector2d(r * std::cos(a), r * std::sin(a)); };
  RC_PRE(contains(polygon, at(azimuth - 1e-9)) == contains(polygon, at(azimuth + 1e-9)));  // not on a border
  RC_ASSERT(azimuths_at(polygon, r).contains(azimuth / kRadiansPerDegree) == contains(polygon, at(azimuth)));
}

TEST(GroundView, CircleThroughARectangle) {
  const GroundPolygon box = rectangle(-1, -2, 3, 2);
  EXPECT_EQ(azimuths_at(box, 0).width_deg(), 360) << "the origin is inside";
  EXPECT_EQ(azimuths_at(box, 0.999).width_deg(), 360);
  EXPECT_NEAR(azimuths_at(box, 2).width_deg(), 240, 1e-9) << "outside of the side behind for 60 degrees to either side";
  EXPECT_EQ(azimuths_at(box, 2.1).sectors().size(), 3u) << "ahead, and one corner to either side";
  EXPECT_EQ(azimuths_at(box, 3.5).sectors().size(), 2u) << "the two corners ahead";
  EXPECT_TRUE(azimuths_at(box, std::hypot(3, 2) + 1e-6).empty());
}

TEST(GroundView, FootprintsOfAWideBaselineDoNotOverlap) {
  GroundView apart = kWide;
  apart.baseline_m = 10;
  EXPECT_TRUE(common_footprint(apart, 0).empty());
  EXPECT_FALSE(far_edge_half_azimuth_rad({}));
  EXPECT_TRUE(azimuths_at({}, 1).empty());
}

TEST(GroundView, ViewsOfTheHorizonHaveNoFootprint) {
  GroundView level = kWide;
  level.tilt_rad = 25 * kRadiansPerDegree;
  EXPECT_FALSE(is_below_horizon(level));
  EXPECT_THROW(footprint(level, 0, 0), std::invalid_argument);
  EXPECT_TRUE(std::isinf(far_edge_m(level)));
}

}  // namespace
}  // namespace spartan
