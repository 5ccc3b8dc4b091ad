#include "spartan/imaging/internal/local_contrast.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "spartan/image_io/opencv_bridge.h"
#include "spartan/numerics/random.h"

namespace spartan::internal {
namespace {

Image<std::uint8_t> test_image(ImageSize size) {
  Random random(3);
  Image<std::uint8_t> image(size);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double level = 90 + 60 * std::sin(0.02 * x) + 20 * std::cos(0.3 * y) + random.uniform(-15, 15);
      image(x, y) = static_cast<std::uint8_t>(std::max(level, 0.0));
    }
  }
  return image;
}

TEST(LocalContrast, AgreesWithOpenCv) {
  for (const ImageSize size : {ImageSize{320, 240}, ImageSize{301, 203}, ImageSize{37, 90}}) {
    for (const auto& [tiles, clip] : {std::pair{8, 2.0}, {8, 40.0}, {3, 4.5}, {1, 3.0}}) {
      // Where only one side is divisible, OpenCV extends the other one by a full pixel per tile.
      if ((size.width % tiles == 0) != (size.height % tiles == 0)) continue;
      const auto image = test_image(size);
      Image<std::uint8_t> ours(size);
      LocalContrast(tiles, clip).apply(image, ours, ThreadPool(1));
      cv::Mat theirs;
      cv::createCLAHE(clip, {tiles, tiles})->apply(as_mat(image), theirs);
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) {
          ASSERT_LE(std::abs(ours(x, y) - theirs.at<std::uint8_t>(y, x)), 1)
              << size.width << " " << tiles << " " << clip << " at " << x << ", " << y;
        }
      }
    }
  }
}

TEST(LocalContrast, AConstantImageStaysConstant) {
  const Image<std::uint8_t> image(65, 43, 90);
  Image<std::uint8_t> result(image.size());
  LocalContrast(8, 2).apply(image, result, ThreadPool(1));
  for (int y = 0; y < 43; ++y) {
    for (int x = 0; x < 65; ++x) ASSERT_EQ(result(x, y), result(0, 0));
  }
}

TEST(LocalContrast, RaisesTheContrastOfADarkCorner) {
  Image<std::uint8_t> image(160, 160, 200);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) image(x, y) = static_cast<std::uint8_t>(20 + (x + y) % 8);
  }
  Image<std::uint8_t> result(image.size());
  LocalContrast(8, 8).apply(image, result, ThreadPool(1));
  EXPECT_GT(result(7, 8) - result(8, 8), 2 * (image(7, 8) - image(8, 8)));
}

TEST(LocalContrast, AnyNumberOfThreadsGivesTheSameBytesAndSizesMayChange) {
  LocalContrast one(8, 2), two(8, 2);
  for (const ImageSize size : {ImageSize{301, 203}, ImageSize{64, 480}, ImageSize{1, 1}}) {
    const auto image = test_image(size);
    Image<std::uint8_t> a(size), b(size);
    one.apply(image, a, ThreadPool(1));
    two.apply(image, b, ThreadPool(2));
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) ASSERT_EQ(a(x, y), b(x, y));
    }
  }
}

TEST(LocalContrast, RejectsInvalidParameters) {
  EXPECT_THROW(LocalContrast(0, 2), std::invalid_argument);
  EXPECT_THROW(LocalContrast(8, 0.5), std::invalid_argument);
  Image<std::uint8_t> image(4, 4), other(5, 4);
  EXPECT_THROW(LocalContrast(8, 2).apply(image, other, ThreadPool(1)), std::invalid_argument);
}

}  // namespace
}  // namespace spartan::internal
