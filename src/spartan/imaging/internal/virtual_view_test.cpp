#include "spartan/imaging/internal/virtual_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "spartan/imaging/imager.h"
#include "spartan/imaging/internal/remap.h"

namespace spartan::internal {
namespace {

using ::testing::HasSubstr;

constexpr ImageSize kSize{160, 120};

Camera camera_with(const CameraModel& model) {
  Camera camera;
  camera.name = "camera";
  camera.size = kSize;
  camera.model = model;
  return camera;
}

// Barrel distortion and different principal points; the right camera is rotated.
const Camera kLeft = camera_with(RadialTangentialModel({125, 126, 82, 57}, {-0.25, 0.06, 2e-4, 3e-5}));
const Camera kRight = camera_with(RadialTangentialModel({127, 126, 76, 63}, {-0.22, 0.04, -3e-4, 1e-4}));
const Pose kRightFromLeft = Pose(exp_so3({0.03, -0.04, 0.05}), {0.1, 0.003, -0.002}).inverse();

Result<Rectification> planned(const VirtualView& view, const Camera& left = kLeft, const Camera& right = kRight) {
  return plan_rectification(left, right, kRightFromLeft, "pair", view);
}

RemapTable table_of(const Camera& camera, const Rectification& plan, const Eigen::Matrix3d& rotation) {
  return {camera.model, camera.size, plan.geometry, rotation, {}, ThreadPool(2), plan.depth_m};
}

double seen_fraction(const RemapTable& table) {
  const auto mask = table.mask();
  if (mask.empty()) return 1;
  int seen = 0;
  for (int y = 0; y < mask.height(); ++y) {
    for (int x = 0; x < mask.width(); ++x) seen += mask(x, y) != 0 ? 1 : 0;
  }
  return static_cast<double>(seen) / (mask.width() * mask.height());
}

bool all_seen(const Rectification& plan) {
  return table_of(kLeft, plan, plan.left_from_rectified).mask().empty() &&
         table_of(kRight, plan, plan.right_from_rectified).mask().empty();
}

TEST(VirtualView, AllValidIsTheWidestViewWithoutMaskedPixels) {
  for (const ImageSize size : {ImageSize{}, ImageSize{320, 100}, ImageSize{60, 90}}) {
    const auto plan = planned({ViewPolicy::all_valid, size});
    ASSERT_TRUE(plan) << plan.error().message();
    EXPECT_EQ(plan->geometry.size, size.empty() ? kSize : size);
    EXPECT_TRUE(all_seen(*plan));
    Rectification wider = *plan;
    for (const double dx : {-1.0, 0.0, 1.0}) {
      for (const double dy : {-1.0, 0.0, 1.0}) {
        wider.geometry.focal_px = plan->geometry.focal_px * 0.98;
        wider.geometry.centre_px = plan->geometry.centre_px + Eigen::Vector2d(dx, dy);
        EXPECT_FALSE(all_seen(wider)) << dx << ", " << dy;
      }
    }
  }
}

TEST(VirtualView, AllValidAcceptsALongerFocalLengthAndRejectsAShorterOne) {
  const double least = planned({ViewPolicy::all_valid})->geometry.focal_px;
  const auto longer = planned({ViewPolicy::all_valid, {}, least * 1.5});
  ASSERT_TRUE(longer);
  EXPECT_EQ(longer->geometry.focal_px, least * 1.5);
  EXPECT_TRUE(all_seen(*longer));
  const auto shorter = planned({ViewPolicy::all_valid, {}, least * 0.9});
  ASSERT_FALSE(shorter);
  EXPECT_EQ(shorter.error().code, ErrorCode::configuration);
  EXPECT_THAT(shorter.error().message(), HasSubstr("a camera does not see"));
}

TEST(VirtualView, WholeViewContainsEveryBorderPixelOfBothSensors) {
  for (const ImageSize size : {ImageSize{}, ImageSize{400, 240}}) {
    const auto plan = planned({ViewPolicy::whole_view, size});
    ASSERT_TRUE(plan) << plan.error().message();
    const RectifiedStereo& g = plan->geometry;
    double nearest_to_border = 1e9;
    const auto look = [&](const Camera& camera, const Eigen::Matrix3d& rotation, double x, double y) {
      const Eigen::Vector3d direction = rotation.transpose() * unproject(camera.model, {x, y})->direction;
      const Eigen::Vector3d position = g.project(direction);
      for (const double inside :
           {position.x(), position.y(), g.size.width - 1 - position.x(), g.size.height - 1 - position.y()}) {
        EXPECT_GT(inside, -0.1) << x << ", " << y;
        nearest_to_border = std::min(nearest_to_border, inside);
      }
    };
    for (int x = 0; x < kSize.width; ++x) {
      for (const int y : {0, kSize.height - 1}) {
        look(kLeft, plan->left_from_rectified, x, y);
        look(kRight, plan->right_from_rectified, x, y);
      }
    }
    for (int y = 0; y < kSize.height; ++y) {
      for (const int x : {0, kSize.width - 1}) {
        look(kLeft, plan->left_from_rectified, x, y);
        look(kRight, plan->right_from_rectified, x, y);
      }
    }
    EXPECT_LT(nearest_to_border, 0.1) << "not larger than needed";
  }
}

TEST(VirtualView, WholeViewOfEqualCamerasMasksNothing) {
  for (const auto& [f, x, y] : {std::array{125.0, 79.5, 59.5}, {125.325, 77.675, 61.275}, {114.6635, 91.80375, 62.1}}) {
    const Camera camera = camera_with(PinholeModel{f, f, x, y});
    const auto plan = plan_rectification(camera, camera, Pose(Eigen::Quaterniond::Identity(), {0.1, 0, 0}).inverse(),
                                         "pair", {ViewPolicy::whole_view, kSize});
    ASSERT_TRUE(plan && !plan->is_identity);
    EXPECT_TRUE(table_of(camera, *plan, plan->left_from_rectified).mask().empty()) << f;
    EXPECT_TRUE(table_of(camera, *plan, plan->right_from_rectified).mask().empty()) << f;
  }
}

TEST(VirtualView, WholeViewRejectsFieldsOfViewBeyondAPlane) {
  const auto too_long = planned({ViewPolicy::whole_view, {}, 500});
  ASSERT_FALSE(too_long);
  EXPECT_EQ(too_long.error().code, ErrorCode::configuration);
  EXPECT_THAT(too_long.error().message(), HasSubstr("not all that the cameras see fits"));
  const Camera wide = camera_with(PinholeModel{4, 4, 80, 60});  // 87° to the side
  const auto too_wide = planned({ViewPolicy::whole_view}, wide, wide);
  ASSERT_FALSE(too_wide);
  EXPECT_EQ(too_wide.error().code, ErrorCode::configuration);
  EXPECT_THAT(too_wide.error().message(), HasSubstr("more than 85°"));
  EXPECT_TRUE(planned({ViewPolicy::keep_resolution}, wide, wide));
}

TEST(VirtualView, RejectsInvalidSizesAndNumbers) {
  const auto rejection = [](const VirtualView& view) {
    const auto plan = planned(view);
    EXPECT_FALSE(plan) << plan->geometry.focal_px;
    if (plan) return std::string();
    EXPECT_EQ(plan.error().code, ErrorCode::configuration);
    return plan.error().message();
  };
  for (const ViewPolicy policy : {ViewPolicy::keep_resolution, ViewPolicy::all_valid, ViewPolicy::whole_view}) {
    EXPECT_THAT(rejection({policy, {1, 100}}), HasSubstr("1 × 100"));
    EXPECT_THAT(rejection({policy, {100, 1}}), HasSubstr("at least 2 × 2"));
    EXPECT_THAT(rejection({policy, {32767, 32767}}), HasSubstr("at most 67108864 px in total"));
    EXPECT_THAT(rejection({policy, {}, std::nan("")}), HasSubstr("focal length"));
    EXPECT_THAT(rejection({policy, {}, -100}), HasSubstr("focal length"));
    EXPECT_THAT(rejection({policy, {}, 0, std::nan("")}), HasSubstr("depth"));
  }
  const Camera pinhole = camera_with(PinholeModel{130, 130, 80, 60});
  const Pose straight = Pose(Eigen::Quaterniond::Identity(), {0.1, 0, 0}).inverse();
  EXPECT_FALSE(plan_rectification(pinhole, pinhole, straight, "pair", {ViewPolicy::all_valid, {}, std::nan("")}));
}

TEST(VirtualView, AllValidRejectsCamerasWithoutACommonView) {
  const Camera narrow = camera_with(PinholeModel{5000, 5000, 80, 60});
  const auto plan = plan_rectification(narrow, narrow, Pose(exp_so3({0.2, 0, 0}), {0.1, 0, 0}).inverse(), "pair",
                                       {ViewPolicy::all_valid});
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().code, ErrorCode::configuration);
  EXPECT_THAT(plan.error().message(), HasSubstr("no common view"));
}

TEST(VirtualView, KeepResolutionUsesTheGivenSizeAndFocalLength) {
  const auto natural = planned({});
  const auto larger = planned({ViewPolicy::keep_resolution, {300, 200}});
  ASSERT_TRUE(natural && larger);
  EXPECT_EQ(larger->geometry.focal_px, natural->geometry.focal_px);
  EXPECT_NEAR(larger->geometry.centre_px.x() - natural->geometry.centre_px.x(), 70, 1e-9);
  EXPECT_NEAR(larger->geometry.centre_px.y() - natural->geometry.centre_px.y(), 40, 1e-9);
  EXPECT_EQ(planned({ViewPolicy::keep_resolution, {}, 99})->geometry.focal_px, 99);
}

// A camera in front of the other one rotates the common axes away from both optical axes.
TEST(VirtualView, CamerasWithLongitudinalOffsetKeepTheirView) {
  struct Offset {
    double focal_px, ahead_m;
  };
  for (const auto& [focal_px, ahead_m] : {Offset{300, 0.05}, {300, 0.08}, {450, 0.08}, {900, 0.014}, {900, 0.03}}) {
    SCOPED_TRACE(::testing::Message() << "f " << focal_px << " px, " << ahead_m << " m ahead");
    const Camera camera = camera_with(PinholeModel{focal_px, focal_px, 79.5, 59.5});
    const auto plan = plan_rectification(camera, camera,
                                         Pose(Eigen::Quaterniond::Identity(), {0.1, 0, ahead_m}).inverse(), "pair", {});
    ASSERT_TRUE(plan) << plan.error().message();
    for (const auto& rotation : {plan->left_from_rectified, plan->right_from_rectified}) {
      EXPECT_GT(seen_fraction(table_of(camera, *plan, rotation)), 0.99);
    }
  }
}

// A principal point outside of the image, as of a shifted lens or a cropped image.
TEST(VirtualView, APrincipalPointOutsideTheImageIsSupported) {
  const Camera camera = camera_with(PinholeModel{300, 300, 500, 60});
  const auto plan =
      plan_rectification(camera, camera, Pose(exp_so3({0, 0.01, 0}), {0.1, 0, 0}).inverse(), "pair", VirtualView{});
  ASSERT_TRUE(plan) << plan.error().message();
  EXPECT_GT(seen_fraction(table_of(camera, *plan, plan->left_from_rectified)), 0.9);
}

TEST(VirtualView, RectifiedImagesPassUnlessSizeOrFocalLengthIsGiven) {
  const Camera pinhole = camera_with(PinholeModel{130, 130, 80, 60});
  const Pose straight = Pose(Eigen::Quaterniond::Identity(), {0.1, 0, 0}).inverse();
  const auto passes = [&](const VirtualView& view) {
    return plan_rectification(pinhole, pinhole, straight, "pair", view)->is_identity;
  };
  EXPECT_TRUE(passes({ViewPolicy::all_valid}));
  EXPECT_TRUE(passes({ViewPolicy::whole_view}));
  EXPECT_FALSE(passes({ViewPolicy::keep_resolution, {80, 60}}));
  EXPECT_FALSE(passes({ViewPolicy::keep_resolution, {}, 65}));
}

}  // namespace
}  // namespace spartan::internal
