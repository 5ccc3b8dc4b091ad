#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>

#include "spartan/imaging/imager.h"
#include "spartan/numerics/random.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;

Camera camera_with(const CameraModel& model) {
  Camera camera;
  camera.name = "camera";
  camera.size = {640, 480};
  camera.model = model;
  return camera;
}

Camera distorted(double focal_px = 500) {
  return camera_with(RadialTangentialModel({focal_px, focal_px + 2, 325, 236}, {-0.28, 0.07, 2e-4, 3e-5}));
}

Pose right_camera_at(const Eigen::Vector3d& position, const Eigen::Vector3d& rotation = Eigen::Vector3d::Zero()) {
  return Pose(exp_so3(rotation), position).inverse();
}

// Pixels of a point of the left camera frame in both rectified views.
struct Views {
  Eigen::Vector2d left, right;
};
Views view(const Rectification& plan, const Pose& right_from_left, const Eigen::Vector3d& point) {
  const auto seen = [&](const Eigen::Vector3d& p) -> Eigen::Vector2d { return plan.geometry.project(p).head<2>(); };
  return {seen(plan.left_from_rectified.transpose() * point),
          seen(plan.right_from_rectified.transpose() * (right_from_left * point))};
}

RC_GTEST_PROP(Rectification, PointsHaveEqualRowsAndTheDisparityOfTheirDepth, (std::uint64_t seed)) {
  Random random(seed);
  const auto perturbation = [&](double size) {
    return Eigen::Vector3d(random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size));
  };
  // The baseline stays mainly along x; others are rejected.
  const Eigen::Vector3d position = Eigen::Vector3d(random.uniform(0.05, 0.6), 0, 0) + perturbation(0.02);
  const Pose right_from_left = right_camera_at(position, perturbation(0.15));
  const auto plan = plan_rectification(distorted(500), distorted(510), right_from_left, "pair");
  if (!plan) RC_FAIL(plan.error().message());
  RC_ASSERT(!plan->is_identity);
  RC_ASSERT(is_rotation(plan->left_from_rectified, 1e-9));
  RC_ASSERT(is_rotation(plan->right_from_rectified, 1e-9));
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d point(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(2, 20));
    const Views views = view(*plan, right_from_left, point);
    const double depth = (plan->left_from_rectified.transpose() * point).z();
    RC_ASSERT(std::abs(views.left.y() - views.right.y()) < 1e-8);
    const double disparity = plan->geometry.focal_px * position.norm() / depth;
    RC_ASSERT(std::abs(views.left.x() - views.right.x() - disparity) < 1e-8);
  }
}

TEST(Rectification, RotatesBothCamerasEquallyAndKeepsResolutionAndCentre) {
  const auto plan = plan_rectification(distorted(), distorted(), right_camera_at({0.1, 0, 0}, {0.06, 0, 0}), "pair");
  ASSERT_TRUE(plan);
  const auto angle = [](const Eigen::Matrix3d& r) { return log_so3(Eigen::Quaterniond(r)).norm(); };
  EXPECT_NEAR(angle(plan->left_from_rectified), 0.03, 1e-6);
  EXPECT_NEAR(angle(plan->right_from_rectified), 0.03, 1e-6);
  EXPECT_NEAR(plan->geometry.focal_px, 501, 0.1);
  EXPECT_NEAR(plan->geometry.centre_px.x(), 319.5, 15);
  EXPECT_EQ(plan->geometry.size, (ImageSize{640, 480}));
}

TEST(Rectification, RectifiedPairsGiveTheIdentity) {
  const Camera pinhole = camera_with(PinholeModel{500, 500, 310, 245});
  const auto plan = plan_rectification(pinhole, pinhole, right_camera_at({0.1, 0, 0}), "pair");
  ASSERT_TRUE(plan);
  EXPECT_TRUE(plan->is_identity);
  EXPECT_EQ(plan->geometry, (RectifiedStereo{{640, 480}, 500, {310, 245}, 0.1}));
  // Zero distortion coefficients also make a pinhole.
  const Camera undistorted = camera_with(RadialTangentialModel({500, 500, 310, 245}, {}));
  EXPECT_TRUE(plan_rectification(undistorted, pinhole, right_camera_at({0.1, 0, 0}), "pair")->is_identity);

  const auto needs_work = [&](const Camera& left, const Camera& right, const Pose& pose) {
    const auto made = plan_rectification(left, right, pose, "pair");
    return made && !made->is_identity;
  };
  const Pose straight = right_camera_at({0.1, 0, 0});
  EXPECT_TRUE(needs_work(pinhole, camera_with(PinholeModel{501, 501, 310, 245}), straight));
  EXPECT_TRUE(needs_work(pinhole, camera_with(PinholeModel{500, 500, 310, 245.1}), straight));
  EXPECT_TRUE(needs_work(camera_with(PinholeModel{500, 502, 310, 245}), camera_with(PinholeModel{500, 502, 310, 245}),
                         straight));
  EXPECT_TRUE(needs_work(pinhole, pinhole, right_camera_at({0.1, 0, 0}, {0, 1e-3, 0})));
  EXPECT_TRUE(needs_work(pinhole, pinhole, right_camera_at({0.1, 1e-3, 0})));
}

TEST(Rectification, RejectsPairsThatAreNotSideBySide) {
  const auto rejection = [](const Pose& pose) {
    const auto plan = plan_rectification(distorted(), distorted(), pose, "rig.yaml: pairs.front");
    EXPECT_FALSE(plan);
    if (plan) return std::string();
    EXPECT_EQ(plan.error().code, ErrorCode::configuration);
    return plan.error().message();
  };
  EXPECT_THAT(rejection(right_camera_at({0.02, 0.1, 0})), HasSubstr("more vertical than horizontal"));
  EXPECT_THAT(rejection(right_camera_at({-0.1, 0, 0})), HasSubstr("swapped"));
  EXPECT_THAT(rejection(right_camera_at({0.02, 0, 0.1})), HasSubstr("behind each other"));
  EXPECT_THAT(rejection(right_camera_at({0.1, 0, 0}, {0, 1.3, 0})), HasSubstr("optical axes differ"));
  EXPECT_THAT(rejection(right_camera_at({-0.1, 0, 0})), HasSubstr("pairs.front"));
}

}  // namespace
}  // namespace spartan
