#include "spartan/camera/internal/sample_depth.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

namespace spartan::internal {
namespace {

PixelFormat format_of(const std::vector<std::uint16_t>& values) {
  Image<std::uint16_t> image(static_cast<int>(values.size()), 1);
  for (std::size_t i = 0; i < values.size(); ++i) image(static_cast<int>(i), 0) = values[i];
  const std::array<FrameImage, 1> images{
      FrameImage::own(std::move(image), PixelFormat{PixelLayout::gray, 16, BitAlignment::low})};
  return sample_format_of(images);
}

PixelFormat low(int bits) {
  return {PixelLayout::gray, bits, BitAlignment::low};
}
PixelFormat high(int bits) {
  return {PixelLayout::gray, bits, BitAlignment::high};
}

TEST(SampleDepth, FollowsFromTheValues) {
  EXPECT_EQ(format_of({0, 1, 1023}), low(10));
  EXPECT_EQ(format_of({5, 1024, 4095}), low(12));
  EXPECT_EQ(format_of({4096, 16383, 1}), low(14));
  EXPECT_EQ(format_of({16384, 3}), low(16));
  EXPECT_EQ(format_of({65535, 0}), low(16));
  EXPECT_EQ(format_of({0x10, 0xFFF0}), high(12));
  EXPECT_EQ(format_of({0x40, 0xFFC0}), high(10));
  EXPECT_EQ(format_of({0x4, 0xFFFC}), high(14));
  EXPECT_EQ(format_of({0x2, 0xFFFE}), low(16));
  EXPECT_EQ(format_of({0, 0}), low(16)) << "black";
  EXPECT_EQ(format_of({16, 32}), low(10)) << "dark, not aligned high";
}

TEST(SampleDepth, FollowsFromAllImages) {
  Image<std::uint16_t> dark(1, 1), bright(1, 1);
  dark(0, 0) = 7;
  bright(0, 0) = 4000;
  const PixelFormat stored{PixelLayout::gray, 16, BitAlignment::low};
  const std::array<FrameImage, 2> images{FrameImage::own(std::move(dark), stored),
                                         FrameImage::own(std::move(bright), stored)};
  EXPECT_EQ(sample_format_of(images), low(12));
}

}  // namespace
}  // namespace spartan::internal
