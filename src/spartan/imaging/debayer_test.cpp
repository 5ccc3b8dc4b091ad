#include "spartan/imaging/debayer.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/imgproc.hpp>

#include "spartan/core/opencv_bridge.h"
#include "spartan/core/random.h"

namespace spartan {
namespace {

struct Pattern {
  PixelLayout layout;
  int opencv_code;  // OpenCV names a pattern by the second row's second and third sample
};
const Pattern kPatterns[] = {{PixelLayout::bayer_rggb, cv::COLOR_BayerBG2RGB},
                             {PixelLayout::bayer_grbg, cv::COLOR_BayerGB2RGB},
                             {PixelLayout::bayer_gbrg, cv::COLOR_BayerGR2RGB},
                             {PixelLayout::bayer_bggr, cv::COLOR_BayerRG2RGB}};

template <class T>
Image<T> random_mosaic(int width, int height, int largest) {
  Random random(5);
  Image<T> mosaic(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      mosaic(x, y) = static_cast<T>(random.below(static_cast<std::uint32_t>(largest) + 1));
    }
  }
  return mosaic;
}

template <class T>
void expect_as_opencv(int largest) {
  for (const ImageSize size : {ImageSize{64, 48}, ImageSize{37, 21}}) {
    const Image<T> mosaic = random_mosaic<T>(size.width, size.height, largest);
    for (const Pattern& pattern : kPatterns) {
      SCOPED_TRACE(name_of(pattern.layout));
      Image<Rgb<T>> ours(size);
      debayer(mosaic.view(), pattern.layout, ours.view(), Workers(2));
      cv::Mat theirs;
      cv::cvtColor(as_mat(mosaic), theirs, pattern.opencv_code);
      const auto reference = as_view<Rgb<T>>(theirs);
      for (int y = 1; y + 1 < size.height; ++y) {
        for (int x = 1; x + 1 < size.width; ++x) {
          ASSERT_LE(std::abs(ours(x, y).r - reference(x, y).r), 1) << x << ", " << y;
          ASSERT_LE(std::abs(ours(x, y).g - reference(x, y).g), 1) << x << ", " << y;
          ASSERT_LE(std::abs(ours(x, y).b - reference(x, y).b), 1) << x << ", " << y;
        }
      }
    }
  }
}

TEST(Debayer, AgreesWithOpenCv8Bit) {
  expect_as_opencv<std::uint8_t>(255);
}

TEST(Debayer, AgreesWithOpenCv16Bit) {
  expect_as_opencv<std::uint16_t>(65535);
}

TEST(Debayer, GivesAUniformColourBackUpToTheBorders) {
  const Rgb16 colour{4000, 2500, 700};
  for (const Pattern& pattern : kPatterns) {
    SCOPED_TRACE(name_of(pattern.layout));
    Image<std::uint16_t> mosaic(11, 8);
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 11; ++x) {
        const std::string_view block = name_of(pattern.layout).substr(6);
        const char sample = block[static_cast<std::size_t>(2 * (y & 1) + (x & 1))];
        mosaic(x, y) = sample == 'r' ? colour.r : sample == 'g' ? colour.g : colour.b;
      }
    }
    Image<Rgb16> rgb(11, 8);
    debayer(mosaic.view(), pattern.layout, rgb.view(), Workers(1));
    Image<std::uint16_t> gray(11, 8);
    debayer(mosaic.view(), pattern.layout, gray.view(), Workers(1));
    for (int y = 0; y < 8; ++y) {
      for (int x = 0; x < 11; ++x) {
        ASSERT_EQ(rgb(x, y), colour) << x << ", " << y;
        ASSERT_EQ(gray(x, y), luma(colour));
      }
    }
  }
}

TEST(Debayer, LumaHasTheFullRange) {
  EXPECT_EQ(luma(Rgb8{255, 255, 255}), 255);
  EXPECT_EQ(luma(Rgb16{65535, 65535, 65535}), 65535);
  EXPECT_EQ(luma(Rgb8{255, 0, 0}), 76);
}

TEST(Debayer, RefusesWhatIsNoMosaic) {
  Image<std::uint8_t> image(4, 4), other(5, 4);
  EXPECT_THROW(debayer(image.view(), PixelLayout::gray, image.view(), Workers(1)), std::invalid_argument);
  EXPECT_THROW(debayer(image.view(), PixelLayout::bayer_rggb, other.view(), Workers(1)), std::invalid_argument);
}

}  // namespace
}  // namespace spartan
