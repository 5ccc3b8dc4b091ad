#include "spartan/odometry/internal/matching/image_pyramid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "spartan/numerics/gradient_noise.h"
#include "spartan/odometry/internal/matching/smoothed_image.h"

namespace spartan::internal {
namespace {

// A texture, moved by (dx, dy).
ImagePyramid pyramid_of(double dx, double dy) {
  const auto octaves = make_octaves(7, 4, 60, 0.7, 40);
  Image<std::uint8_t> image(320, 240);
  for (int y = 0; y < 240; ++y) {
    for (int x = 0; x < 320; ++x) {
      double value = 128;
      for (const auto& octave : octaves) value += octave.value(x - dx, y - dy);
      image(x, y) = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0)));
    }
  }
  SmoothedImage smooth;
  smooth.compute(image, ThreadPool(1));
  ImagePyramid pyramid;
  pyramid.compute(smooth.view());
  return pyramid;
}

TEST(ImagePyramid, LevelsAreMeansAtTheirPlaces) {
  Image<std::uint16_t> ramp(97, 61);
  for (int y = 0; y < ramp.height(); ++y)
    for (int x = 0; x < ramp.width(); ++x) ramp(x, y) = static_cast<std::uint16_t>(256 * x + 100 * y);
  ImagePyramid pyramid;
  pyramid.compute(ramp);
  constexpr int m = ImagePyramid::kMargin;
  for (int level = 0; level < ImagePyramid::kLevels; ++level) {
    const int scale = ImagePyramid::kScale[static_cast<std::size_t>(level)];
    const auto view = pyramid.level(level);
    EXPECT_EQ(view.width(), 96 / scale + 1 + 2 * m);
    EXPECT_EQ(view.height(), 60 / scale + 1 + 2 * m);
    // Away from the border a linear image keeps its values.
    EXPECT_NEAR(view(m + 6, m + 4), 256 * 6 * scale + 100 * 4 * scale, 1);
    EXPECT_EQ(view(0, m + 3), view(m, m + 3)) << "the border is replicated";
  }
}

TEST(ImagePyramid, FindsPointsFarFromTheirPrediction) {
  const ImagePyramid previous = pyramid_of(0, 0);
  for (const auto& [dx, dy] : {std::pair(0.0, 0.0), {5.5, -3.0}, {-14.0, 9.0}, {21.0, 6.0}}) {
    const ImagePyramid current = pyramid_of(dx, dy);
    int found = 0, right = 0;
    for (int y = 60; y <= 180; y += 20) {
      for (int x = 60; x <= 260; x += 20) {
        const Eigen::Vector2d at(x, y);
        const auto position = find_in_pyramid(previous, current, at, Eigen::Matrix2d::Identity(), at, 0.7);
        if (!position) continue;
        ++found;
        right += (*position - at - Eigen::Vector2d(dx, dy)).norm() < 1.5;
      }
    }
    EXPECT_GT(found, 50) << dx << " of 77";
    EXPECT_GT(right, 0.9 * found) << dx;
  }
}

TEST(ImagePyramid, FindsNothingWithoutTexture) {
  ImagePyramid flat;
  flat.compute(Image<std::uint16_t>(200, 100, 9000));
  const Eigen::Vector2d at(100, 50);
  EXPECT_FALSE(find_in_pyramid(flat, flat, at, Eigen::Matrix2d::Identity(), at, 0.7).has_value());
  EXPECT_FALSE(find_in_pyramid({}, flat, at, Eigen::Matrix2d::Identity(), at, 0.7).has_value());
}

}  // namespace
}  // namespace spartan::internal
