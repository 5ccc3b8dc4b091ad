#include "spartan/odometry/internal/detection/integral_image.h"

#include <gtest/gtest.h>

#include "spartan/numerics/random.h"

namespace spartan::internal {
namespace {

Image<std::uint8_t> random_image(int width, int height) {
  Image<std::uint8_t> image(width, height);
  Random random(7);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image(x, y) = static_cast<std::uint8_t>(random.below(256));
  return image;
}

std::uint32_t brute_force_sum(const Image<std::uint8_t>& image, int x0, int y0, int x1, int y1) {
  std::uint32_t sum = 0;
  for (int y = std::max(y0, 0); y < std::min(y1, image.height()); ++y)
    for (int x = std::max(x0, 0); x < std::min(x1, image.width()); ++x) sum += image(x, y);
  return sum;
}

TEST(IntegralImage, SumsOfAllRectanglesAreExact) {
  for (const auto& [width, height] : {std::pair(1, 1), {7, 5}, {13, 9}}) {
    const Image<std::uint8_t> image = random_image(width, height);
    IntegralImage integral;
    integral.compute(image);
    for (int y0 = 0; y0 <= height; ++y0) {
      for (int y1 = y0; y1 <= height; ++y1) {
        for (int x0 = 0; x0 <= width; ++x0) {
          for (int x1 = x0; x1 <= width; ++x1)
            ASSERT_EQ(integral.box(x0, y0, x1, y1), brute_force_sum(image, x0, y0, x1, y1));
        }
      }
    }
  }
}

TEST(IntegralImage, ClipsRectanglesToTheImage) {
  const Image<std::uint8_t> image = random_image(11, 8);
  IntegralImage integral;
  integral.compute(image);
  EXPECT_EQ(integral.clipped_box(-5, -3, 4, 6), brute_force_sum(image, -5, -3, 4, 6));
  EXPECT_EQ(integral.clipped_box(6, 2, 40, 40), brute_force_sum(image, 6, 2, 40, 40));
  EXPECT_EQ(integral.clipped_box(20, 20, 40, 40), 0u);
  EXPECT_EQ(integral.clipped_box(-9, 0, -2, 8), 0u);
}

TEST(IntegralImage, AcceptsAnImageOfAnotherSize) {
  IntegralImage integral;
  integral.compute(random_image(30, 20));
  const Image<std::uint8_t> image = random_image(9, 10);
  integral.compute(image);
  EXPECT_EQ(integral.width(), 9);
  EXPECT_EQ(integral.box(0, 0, 9, 10), brute_force_sum(image, 0, 0, 9, 10));
}

}  // namespace
}  // namespace spartan::internal
