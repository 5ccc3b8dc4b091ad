#include "spartan/core/frame_image.h"

#include <gtest/gtest.h>

namespace spartan {
namespace {

TEST(FrameImage, SharesOwnershipOfItsPixels) {
  FrameImage copy;
  {
    Image<std::uint16_t> pixels(7, 3);
    pixels(6, 2) = 4095;
    const FrameImage frame = FrameImage::own(std::move(pixels), {PixelLayout::bayer_rggb, 12, BitAlignment::low});
    copy = frame;
  }
  EXPECT_EQ(copy.size(), (ImageSize{7, 3}));
  EXPECT_EQ(copy.as<std::uint16_t>()(6, 2), 4095);
  EXPECT_TRUE(copy.format().is_bayer());
}

TEST(FrameImage, BorrowsWithoutCopying) {
  Image<std::uint8_t> pixels(9, 4);
  const FrameImage frame =
      FrameImage::borrow(ImageView<const std::uint8_t>(pixels).crop(2, 1, 5, 3), {PixelLayout::gray, 8});
  pixels(2, 1) = 77;
  EXPECT_EQ(frame.as<std::uint8_t>()(0, 0), 77);
  EXPECT_EQ(frame.as<std::uint8_t>().row(1), pixels.row(2) + 2);
}

TEST(FrameImage, HandlesTheRowStrideOfThreeBytePixels) {
  Image<Rgb8> pixels(5, 3);
  pixels(4, 2) = {1, 2, 3};
  const FrameImage frame = FrameImage::own(std::move(pixels), {PixelLayout::rgb, 8});
  EXPECT_EQ(frame.as<Rgb8>()(4, 2), (Rgb8{1, 2, 3}));
}

TEST(FrameImage, RejectsTheWrongPixelType) {
  EXPECT_THROW(FrameImage::own(Image<std::uint8_t>(2, 2), {PixelLayout::gray, 12}), std::invalid_argument);
  EXPECT_THROW(FrameImage::own(Image<std::uint8_t>(2, 2), {PixelLayout::rgb, 8}), std::invalid_argument);
  EXPECT_THROW(FrameImage::own(Image<Rgb8>(2, 2), {PixelLayout::gray, 8}), std::invalid_argument);
  const FrameImage frame = FrameImage::own(Image<Rgb16>(2, 2), {PixelLayout::rgb, 10});
  EXPECT_NO_THROW(frame.as<Rgb16>());
  EXPECT_THROW(frame.as<Rgb8>(), std::invalid_argument);
  EXPECT_THROW(frame.as<std::uint16_t>(), std::invalid_argument);
}

TEST(PixelFormat, FullScaleDependsOnBitsAndAlignment) {
  EXPECT_EQ((PixelFormat{PixelLayout::gray, 8, BitAlignment::high}.full_scale()), 255);
  EXPECT_EQ((PixelFormat{PixelLayout::gray, 12, BitAlignment::low}.full_scale()), 4095);
  EXPECT_EQ((PixelFormat{PixelLayout::gray, 12, BitAlignment::high}.full_scale()), 65520);
  EXPECT_EQ((PixelFormat{PixelLayout::gray, 16, BitAlignment::high}.full_scale()), 65535);
  EXPECT_EQ((PixelFormat{PixelLayout::gray, 9, BitAlignment::low}.bytes_per_sample()), 2);
  EXPECT_EQ(name_of(PixelLayout::bayer_gbrg), "bayer_gbrg");
}

}  // namespace
}  // namespace spartan
