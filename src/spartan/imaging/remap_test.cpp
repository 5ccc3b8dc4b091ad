#include "spartan/imaging/remap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "spartan/core/random.h"
#include "spartan/core/rotation.h"

namespace spartan {
namespace {

constexpr ImageSize kSource{160, 120};

CameraModel camera() {
  return RadialTangentialModel({130, 131, 81, 58}, {-0.28, 0.07, 2e-4, 3e-5});
}

RectifiedStereo odd_view() {
  return {{149, 113}, 128, {75.3, 55.1}, 0.1};
}

Image<std::uint8_t> noise_picture(ImageSize size) {
  Random random(1);
  Image<std::uint8_t> picture(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) picture(x, y) = static_cast<std::uint8_t>(random.below(256));
  }
  return picture;
}

// The plain reference: where a pixel of the view looks in the camera.
std::optional<Eigen::Vector2d> place(const RectifiedStereo& view, const Eigen::Matrix3d& turn, int x, int y) {
  const Eigen::Vector3d direction((x - view.centre_px.x()) / view.focal_px, (y - view.centre_px.y()) / view.focal_px,
                                  1);
  return project(camera(), turn * direction);
}

TEST(RemapTable, HoldsEveryPlaceToAHundredthOfAPixel) {
  const Eigen::Matrix3d turn = exp_so3({0.02, -0.15, 0.03}).toRotationMatrix();
  const RectifiedStereo view = odd_view();
  const RemapTable table(camera(), kSource, view, turn, {}, Workers(2));
  ASSERT_FALSE(table.mask().empty());
  int valid = 0;
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      const auto exact = place(view, turn, x, y);
      const bool inside = exact && exact->x() >= 0 && exact->y() >= 0 && exact->x() <= kSource.width - 1 &&
                          exact->y() <= kSource.height - 1;
      ASSERT_EQ(table.mask()(x, y), inside ? 255 : 0) << x << ", " << y;
      if (!inside) continue;
      ++valid;
      ASSERT_LE((table.source_of(x, y) - *exact).norm(), 0.01);
    }
  }
  EXPECT_GT(valid, view.size.width * view.size.height / 2);
}

TEST(RemapTable, InterpolatesAsAPlainReferenceDoes) {
  const RectifiedStereo view = odd_view();
  const RemapTable table(camera(), kSource, view, Eigen::Matrix3d::Identity(), {}, Workers(1));
  const auto source = noise_picture(kSource);
  Image<std::uint8_t> result(view.size), threaded(view.size);
  table.apply(source, result, Workers(1));
  table.apply(source, threaded, Workers(2));
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      ASSERT_EQ(result(x, y), threaded(x, y));
      if (!table.mask().empty() && table.mask()(x, y) == 0) {
        ASSERT_EQ(result(x, y), 0);
        continue;
      }
      const Eigen::Vector2d p = table.source_of(x, y);
      const int px = std::min(static_cast<int>(p.x()), kSource.width - 2);
      const int py = std::min(static_cast<int>(p.y()), kSource.height - 2);
      const double fx = p.x() - px, fy = p.y() - py;
      const double level = (1 - fy) * ((1 - fx) * source(px, py) + fx * source(px + 1, py)) +
                           fy * ((1 - fx) * source(px, py + 1) + fx * source(px + 1, py + 1));
      ASSERT_NEAR(result(x, y), level, 0.501);
    }
  }
}

TEST(RemapTable, TheIdentityGivesTheImageBackToItsLastPixel) {
  const RectifiedStereo view{kSource, 100, {80, 60}, 0.1};
  const RemapTable table(PinholeModel{100, 100, 80, 60}, kSource, view, Eigen::Matrix3d::Identity(), {}, Workers(1));
  EXPECT_TRUE(table.mask().empty());
  const auto source = noise_picture(kSource);
  Image<std::uint8_t> result(kSource);
  table.apply(source, result, Workers(1));
  for (int y = 0; y < kSource.height; ++y) {
    for (int x = 0; x < kSource.width; ++x) ASSERT_EQ(result(x, y), source(x, y)) << x << ", " << y;
  }
}

TEST(RemapTable, WarpsTheSelfMaskAlong) {
  const RectifiedStereo view{kSource, 100, {80, 60}, 0.1};
  Image<std::uint8_t> self_mask(kSource.width, kSource.height, 255);
  self_mask(50, 40) = 0;
  // The view stands a quarter of a pixel beside the camera: two of its pixels touch the masked one.
  const RemapTable table(PinholeModel{100, 100, 80.25, 60}, kSource, view, Eigen::Matrix3d::Identity(), self_mask,
                         Workers(1));
  EXPECT_EQ(table.mask()(49, 40), 0);
  EXPECT_EQ(table.mask()(50, 40), 0);
  EXPECT_EQ(table.mask()(48, 40), 255);
  EXPECT_EQ(table.mask()(51, 40), 255);
  EXPECT_EQ(table.mask()(159, 40), 0) << "looks past the sensor";
}

TEST(RemapTable, RefusesOtherSizes) {
  const RemapTable table(camera(), kSource, odd_view(), Eigen::Matrix3d::Identity(), {}, Workers(1));
  Image<std::uint8_t> small(100, 100), result(odd_view().size);
  EXPECT_THROW(table.apply(small, result, Workers(1)), std::invalid_argument);
}

}  // namespace
}  // namespace spartan
