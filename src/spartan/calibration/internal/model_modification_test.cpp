#include "spartan/calibration/internal/model_modification.h"

#include <gtest/gtest.h>

namespace spartan::internal {
namespace {

constexpr PinholeModel kPinhole{500, 510, 320, 240};
const Eigen::Vector3d kPoint(0.3, -0.2, 0.9);

// The corner of the image, half a pixel from the centre of the first pixel, is fixed.
TEST(ModelChanges, ResizingScalesPixelCoordinates) {
  for (const CameraModel& model : {CameraModel(kPinhole), CameraModel(CahvModel{kPinhole, 3}),
                                   CameraModel(RadialTangentialModel(kPinhole, {-0.2, 0.05, 1e-3, 2e-3}))}) {
    for (const double factor : {0.5, 2.0}) {
      const Eigen::Vector2d before = *project(model, kPoint), after = *project(resized(model, factor), kPoint);
      EXPECT_LT(((before.array() + 0.5) * factor - 0.5 - after.array()).matrix().norm(), 1e-9) << name_of(model);
      const Eigen::Vector2d centre(320, 240), longer = *project(with_scaled_focal_length(model, factor), kPoint);
      EXPECT_LT((longer - centre - factor * (before - centre)).norm(), 1e-9) << name_of(model);
    }
  }
}

TEST(ModelChanges, RowOffsetsShiftTheImage) {
  for (const CameraModel& model : {CameraModel(kPinhole), CameraModel(CahvModel{kPinhole, 3}),
                                   CameraModel(RadialTangentialModel(kPinhole, {-0.2, 0.05, 1e-3, 2e-3}))}) {
    const Eigen::Vector2d before = *project(model, kPoint), after = *project(with_row_offset(model, 7), kPoint);
    EXPECT_LT((after - before - Eigen::Vector2d(0, 7)).norm(), 1e-9) << name_of(model);
  }
}

// r_u = r_d/(1 + k r_d²), from the centre to the corner of the image.
TEST(ModelChanges, DivisionModelIsApproximated) {
  constexpr ImageSize kSize{640, 480};
  for (const double k : {-0.6, -0.3, -0.1, 0.1, 0.4}) {
    const CameraModel bent = with_division_distortion(kPinhole, k, kSize);
    for (double r_d = 0; r_d < 0.8; r_d += 0.05) {
      const auto seen = project(bent, {r_d / (1 + k * r_d * r_d), 0, 1});
      ASSERT_TRUE(seen) << k << " " << r_d;
      EXPECT_NEAR(seen->x(), 320 + 500 * r_d, 0.01) << k << " " << r_d;
    }
  }
  constexpr double k = -0.1;
  const CameraModel fisheye = EquidistantModel(kPinhole, {});
  EXPECT_EQ(with_division_distortion(fisheye, k, kSize), fisheye);
}

}  // namespace
}  // namespace spartan::internal
