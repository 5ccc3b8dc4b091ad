#include "spartan/imaging/internal/view_footprint.h"

#include <gtest/gtest.h>

#include "spartan/core/pose.h"
#include "spartan/imaging/internal/remap.h"

namespace spartan::internal {
namespace {

// The table maps from the view to the camera, the footprint from the camera to the view.
TEST(ViewFootprint, CoversThePositionsOfTheTable) {
  Camera camera;
  camera.size = {157, 121};
  camera.model = RadialTangentialModel({130, 131, 81, 58}, {-0.28, 0.07, 2e-4, 3e-5});
  const RectifiedStereo view{{149, 113}, 200, {75.3, 55.1}, 0.1};
  const Eigen::Matrix3d rotation = exp_so3({0.02, -0.15, 0.03}).toRotationMatrix();
  const auto footprint = view_footprint(camera, view, rotation, 1 << 20);
  const RemapTable table(camera.model, camera.size, view, rotation, {}, ThreadPool(1), 1 << 20);
  Image<std::uint8_t> looked_at(camera.size);
  for (int y = 0; y < view.size.height; ++y) {
    for (int x = 0; x < view.size.width; ++x) {
      if (!table.mask().empty() && table.mask()(x, y) == 0) continue;
      const Eigen::Vector2d position = table.source_of(x, y);
      looked_at(static_cast<int>(position.x()), static_cast<int>(position.y())) = 255;
    }
  }
  // Whole blocks are inside or outside: the border is accurate to half a block.
  int in_both = 0;
  const auto near_any = [&](const Image<std::uint8_t>& image, int x, int y, int level) {
    for (int j = -6; j <= 6; ++j) {
      for (int i = -6; i <= 6; ++i) {
        if (image.contains(x + i, y + j) && image(x + i, y + j) == level) return true;
      }
    }
    return false;
  };
  for (int y = 0; y < camera.size.height; ++y) {
    for (int x = 0; x < camera.size.width; ++x) {
      if (looked_at(x, y) != 0) {
        ASSERT_TRUE(near_any(footprint, x, y, 255)) << x << ", " << y;
      }
      if (footprint(x, y) != 0) {
        ASSERT_TRUE(near_any(looked_at, x, y, 255)) << x << ", " << y;
      }
      in_both += footprint(x, y) != 0 && looked_at(x, y) != 0 ? 1 : 0;
    }
  }
  EXPECT_GT(in_both, 4000);
  EXPECT_LT(in_both, 15000);
}

TEST(ViewFootprint, ExcludesPixelsOutsideTheModelDomain) {
  Camera camera;
  camera.size = {160, 120};
  camera.model = EquidistantModel({40, 40, 79.5, 59.5}, {});  // 90° at 63 px
  const auto footprint =
      view_footprint(camera, {{160, 120}, 5, {79.5, 59.5}, 0.1}, Eigen::Matrix3d::Identity(), 1 << 20);
  EXPECT_EQ(footprint(79, 59), 255);
  EXPECT_EQ(footprint(4, 4), 0);
  EXPECT_EQ(footprint(155, 60), 0);
}

}  // namespace
}  // namespace spartan::internal
