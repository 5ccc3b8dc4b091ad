#include "spartan/rig/camera_model.h"

#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <string>
#include <vector>

#include "spartan/testing/camera_model_laws.h"

namespace spartan {
namespace {

constexpr ImageSize kSize{752, 480};
const PinholeModel kPinhole{458.654, 457.296, 367.215, 248.375};

// Nearly none, EuRoC's, strong barrel, pincushion, k3, and the rational form.
const std::vector<RadialTangentialModel::Coefficients> kLenses{
    {1e-9, 0, 0, 0},
    {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05},
    {-0.25, 0.08, 0.001, -0.002, -0.005},
    {0.15, 0.02, -0.001, 0.0005},
    {0.1, -0.2, 0.0004, -0.0007, 0.05},
    {0.3, 0.1, 0.0005, -0.0003, 0.01, 0.5, 0.15, 0.02},
};

CameraModel lens(std::size_t i) {
  return RadialTangentialModel(kPinhole, kLenses[i]);
}

TEST(Pinhole, ObeysTheLaws) {
  testing::expect_round_trips(kPinhole, kSize);
  testing::expect_true_jacobians(kPinhole, kSize);
  testing::expect_honest_limits(kPinhole);
}

TEST(RadialTangential, ObeysTheLaws) {
  for (std::size_t i = 0; i < kLenses.size(); ++i) {
    SCOPED_TRACE(i);
    testing::expect_round_trips(lens(i), kSize);
    testing::expect_true_jacobians(lens(i), kSize);
    testing::expect_honest_limits(lens(i));
  }
}

TEST(RadialTangential, ProjectsAsOpenCv) {
  const cv::Matx33d k(kPinhole.fx, 0, kPinhole.cx, 0, kPinhole.fy, kPinhole.cy, 0, 0, 1);
  for (std::size_t i = 0; i < kLenses.size(); ++i) {
    const std::vector<double> d(kLenses[i].begin(), kLenses[i].end());
    for (const Eigen::Vector2d& pixel : testing::picture_grid(kSize, 8)) {
      const Eigen::Vector3d point = 2.5 * unproject(lens(i), pixel)->direction;
      std::vector<cv::Point2d> seen;
      cv::projectPoints(std::vector<cv::Point3d>{{point.x(), point.y(), point.z()}}, cv::Vec3d(), cv::Vec3d(), k, d,
                        seen);
      const Eigen::Vector2d ours = *project(lens(i), point);
      EXPECT_LE(std::hypot(ours.x() - seen[0].x, ours.y() - seen[0].y), 1e-9) << "lens " << i;
    }
  }
}

// Beyond the radius where the map stops growing a pixel would have two lines of sight: there is no answer.
TEST(RadialTangential, AnswersOnlyWhereTheMapGrows) {
  const RadialTangentialModel barrel(kPinhole, {-0.3, 0, 0, 0});
  // d(r − 0.3 r³)/dr = 0 at r = 1/√0.9
  EXPECT_NEAR(barrel.largest_radius(), 1 / std::sqrt(0.9), 1e-9);
  EXPECT_TRUE(barrel.project({1.05, 0, 1}));
  EXPECT_FALSE(barrel.project({1.06, 0, 1}));
  const double farthest = 1 / std::sqrt(0.9) * (1 - 0.3 / 0.9);
  EXPECT_TRUE(barrel.unproject({kPinhole.cx + 0.999 * farthest * kPinhole.fx, kPinhole.cy}));
  EXPECT_FALSE(barrel.unproject({kPinhole.cx + 1.001 * farthest * kPinhole.fx, kPinhole.cy}));
}

TEST(CameraModel, IsKnownByItsName) {
  EXPECT_EQ(camera_model_names(), (std::vector<std::string_view>{"pinhole", "radial_tangential"}));
  EXPECT_FALSE(camera_model_named("fisheye"));
  for (const std::string_view name : camera_model_names()) EXPECT_EQ(name_of(*camera_model_named(name)), name);
}

TEST(CameraModel, NumbersGoThereAndBack) {
  for (std::size_t i = 0; i < kLenses.size(); ++i) {
    EXPECT_EQ(with_parameters(*camera_model_named("radial_tangential"), parameters(lens(i))), lens(i)) << i;
  }
  EXPECT_EQ(with_parameters(PinholeModel{}, parameters(CameraModel(kPinhole))), CameraModel(kPinhole));
  // As short as it can be told without loss.
  EXPECT_EQ(parameters(lens(1))[2].size(), 4u);
  EXPECT_EQ(parameters(lens(2))[2].size(), 5u);
  EXPECT_EQ(parameters(lens(5))[2].size(), 8u);
}

}  // namespace
}  // namespace spartan
