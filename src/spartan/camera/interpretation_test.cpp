#include <gtest/gtest.h>

#include "spartan/camera/recording.h"

namespace spartan {
namespace {

const PixelFormat kBayer8{PixelLayout::bayer_grbg, 8}, kBayer12{PixelLayout::bayer_rggb, 12, BitAlignment::high},
    kGray8{}, kGray10{PixelLayout::gray, 10}, kRgb8{PixelLayout::rgb, 8}, kRgb16{PixelLayout::rgb, 16};

FrameImage gray8() {
  return FrameImage::own(Image<std::uint8_t>(4, 3, 7), kGray8);
}
FrameImage gray16() {
  return FrameImage::own(Image<std::uint16_t>(4, 3, 700), PixelFormat{PixelLayout::gray, 16});
}

TEST(Interpretation, GraySamplesGetTheBayerLayoutOfTheCamera) {
  EXPECT_EQ(interpret(gray8(), kBayer8).format(), kBayer8);
  EXPECT_EQ(interpret(gray16(), kBayer12).format(), kBayer12);
  EXPECT_EQ(interpret(gray16(), kBayer12).as<std::uint16_t>()(2, 1), 700);
}

TEST(Interpretation, BitsOfTheFrameOverrideThoseOfTheCamera) {
  EXPECT_EQ(interpret(gray16(), kGray10).format(), kGray10);
  EXPECT_EQ(interpret(gray16(), kGray10, 14).format().bits, 14);
  EXPECT_EQ(interpret(gray8(), kGray8, 12).format(), kGray8) << "a byte holds no more than 8";
}

TEST(Interpretation, RgbStaysRgb) {
  EXPECT_EQ(interpret(FrameImage::own(Image<Rgb8>(4, 3), kRgb8), kGray8).format(), kRgb8);
  EXPECT_EQ(interpret(FrameImage::own(Image<Rgb16>(4, 3), kRgb16), kGray10).format(),
            (PixelFormat{PixelLayout::rgb, 10}));
}

TEST(Interpretation, KeepsAFormatThatContradictsTheCamera) {
  EXPECT_EQ(interpret(gray8(), kRgb8).format(), kGray8);
  const auto colour = FrameImage::own(Image<Rgb8>(4, 3), kRgb8);
  EXPECT_EQ(interpret(colour, kBayer8).format(), kRgb8) << "RGB cannot become a mosaic again";
  EXPECT_EQ(interpret(gray8(), kGray10).format(), kGray8);
}

}  // namespace
}  // namespace spartan
