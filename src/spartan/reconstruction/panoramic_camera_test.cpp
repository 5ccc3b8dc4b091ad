#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <vector>

#include "spartan/reconstruction/disparity_merger.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/height_field_view.h"

namespace spartan {
namespace {

using Projection = PanoramicCamera::Projection;

RC_GTEST_PROP(PanoramicCamera, ProjectionInvertsDirection, (bool cylinder)) {
  const auto some = [](int low, int high) { return 0.1 * *rc::gen::inRange(10 * low, 10 * high); };
  const PanoramicCamera camera(cylinder ? Projection::cylinder : Projection::sphere, {900, 400}, 300, 1.4, 0.3);
  const double u = some(0, 900), v = some(0, 400);
  const Eigen::Vector3d d = camera.direction(u, v);
  RC_ASSERT(std::abs(d.norm() - 1) < 1e-12);
  const auto pixel = camera.project(7.3 * d);
  RC_ASSERT(pixel.has_value());
  RC_ASSERT((*pixel - Eigen::Vector2d(u, v)).norm() < 1e-9);
}

TEST(PanoramicCamera, ColumnsIncreaseToTheRightAndRowsDownwards) {
  const PanoramicCamera camera(Projection::cylinder, {900, 400}, 300, 1.0, 0.5);
  const Eigen::Vector2d ahead = *camera.project({1, 0, 0}), left = *camera.project({1, 0.5, 0}),
                        below = *camera.project({1, 0, -0.5});
  EXPECT_NEAR(ahead.x(), 300, 1e-9);
  EXPECT_NEAR(ahead.y(), 150, 1e-9);
  EXPECT_LT(left.x(), ahead.x());
  EXPECT_NEAR(below.y(), 300, 1e-9) << "a slope of one half is half a unit lower";
  EXPECT_FALSE(camera.project({0, 0, -1}));
}

TEST(PanoramicCamera, ContainsTheFieldsOfViewTightly) {
  const RectifiedStereo g{{320, 320}, 343, {159.5, 159.5}, 0.2};
  std::vector<ViewGeometry> views;
  for (const double pan : {-0.6, 0.0, 0.6})
    views.push_back({g, testing::camera_pose_at(1, pan, 0.68, optical_from_forward())});
  const Pose centre = Pose::from_translation({0, 0.1, 1});
  for (const Projection projection : {Projection::cylinder, Projection::sphere}) {
    const PanoramicCamera camera = plan_panorama(projection, 300, centre, views, 0.8, 6);
    Eigen::Vector2d lowest(1e9, 1e9), highest(-1e9, -1e9);
    for (const ViewGeometry& view : views) {
      for (int v = 0; v < 320; v += 29) {
        for (int u = 0; u < 320; u += 29) {
          for (const double depth : {0.8, 2.0, 6.0}) {
            const Eigen::Vector3d p =
                centre.inverse() * view.body_from_left * g.triangulate(u, v, g.focal_px * g.baseline_m / depth);
            const Eigen::Vector2d pixel = *camera.project(p);
            lowest = lowest.cwiseMin(pixel);
            highest = highest.cwiseMax(pixel);
            EXPECT_GE(pixel.x(), -0.5);
            EXPECT_GE(pixel.y(), -0.5);
            EXPECT_LT(pixel.x(), camera.size().width - 0.5);
            EXPECT_LT(pixel.y(), camera.size().height - 0.5);
          }
        }
      }
    }
    EXPECT_LT(lowest.maxCoeff(), 2) << "the image is not much larger than necessary";
    EXPECT_GT(highest.x(), camera.size().width - 3);
    EXPECT_GT(highest.y(), camera.size().height - 3);
  }
}

}  // namespace
}  // namespace spartan
