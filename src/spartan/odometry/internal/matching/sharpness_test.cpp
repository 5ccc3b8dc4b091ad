#include "spartan/odometry/internal/matching/sharpness.h"

#include <gtest/gtest.h>

namespace spartan::internal {
namespace {

/// Stripes of the given width along one axis, gray levels 0 and 100 times 256.
Image<std::uint16_t> stripes(int width_px, bool along_x) {
  Image<std::uint16_t> image(97, 41);
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) image(x, y) = ((along_x ? x : y) / width_px) % 2 == 0 ? 0 : 25600;
  return image;
}

TEST(Sharpness, IsTheMeanDifferenceOfNeighbours) {
  // Steps of 100 gray levels at every fourth of the 96 pairs of neighbours.
  const Image<std::uint16_t> image = stripes(4, true);
  const Sharpness sharpness = sharpness_of(image);
  EXPECT_FLOAT_EQ(sharpness.along_x, 25600.0f * 24 / 96);
  EXPECT_EQ(sharpness.along_y, 0);
  const Image<std::uint16_t> turned = stripes(1, false);
  EXPECT_FLOAT_EQ(sharpness_of(turned).along_y, 25600);
  EXPECT_EQ(sharpness_of(ImageView<const std::uint16_t>()).along_x, 0);
}

TEST(Sharpness, AnImageIsBlurredWhereEitherDirectionHasLostALot) {
  EXPECT_FALSE(is_blurred({80, 100}, {100, 100}));
  EXPECT_TRUE(is_blurred({40, 100}, {100, 100}));
  EXPECT_TRUE(is_blurred({100, 40}, {100, 100}));
  EXPECT_FALSE(is_blurred({40, 40}, {})) << "nothing to compare with";
}

}  // namespace
}  // namespace spartan::internal
