#include "spartan/system/internal/frozen_cameras.h"

#include <gtest/gtest.h>

#include <set>

namespace spartan::internal {
namespace {

template <class Pixel>
FrameImage image_of(const Image<Pixel>& pixels, PixelFormat format) {
  return FrameImage::borrow(pixels.view(), format);
}

TEST(FrozenCameras, FingerprintsDifferInEveryPixelAndInTheSize) {
  std::set<std::uint64_t> seen;
  int images = 0;
  for (const ImageSize size : {ImageSize{13, 4}, ImageSize{4, 13}}) {
    Image<std::uint8_t> image(size);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        image(x, y) = 1;
        seen.insert(fingerprint(image_of(image, {})));
        image(x, y) = 0;
        ++images;
      }
    }
  }
  EXPECT_EQ(seen.size(), static_cast<std::size_t>(images));
  EXPECT_EQ(seen.count(0), 0U);
}

TEST(FrozenCameras, FingerprintsAreOfThePixelsOnly) {
  Image<std::uint8_t> image(20, 6);
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 20; ++x) image(x, y) = static_cast<std::uint8_t>(7 * x + 31 * y);
  }
  Image<std::uint8_t> part(9, 4);
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 9; ++x) part(x, y) = image(x + 3, y + 1);
  }
  const ImageView<const std::uint8_t> cropped = image.view().crop(3, 1, 9, 4);
  EXPECT_EQ(fingerprint(FrameImage::borrow(cropped, {})), fingerprint(image_of(part, {}))) << "not of the stride";
}

TEST(FrozenCameras, UniformImagesHaveNoFingerprint) {
  EXPECT_EQ(fingerprint(FrameImage()), 0U);
  EXPECT_EQ(fingerprint(image_of(Image<std::uint8_t>(8, 5), {})), 0U);
  EXPECT_EQ(fingerprint(image_of(Image<std::uint16_t>(8, 5, 4095), {PixelLayout::gray, 12})), 0U);
  Image<Rgb16> colour(8, 5, Rgb16{1, 2, 3});
  const PixelFormat rgb{PixelLayout::rgb, 12};
  EXPECT_EQ(fingerprint(image_of(colour, rgb)), 0U);
  colour(7, 4).b = 4;
  EXPECT_NE(fingerprint(image_of(colour, rgb)), 0U);
  Image<Rgb8> colour8(8, 5);
  colour8(0, 0).r = 1;
  EXPECT_NE(fingerprint(image_of(colour8, {PixelLayout::rgb})), 0U);
}

TEST(FrozenCameras, ComparesTheImagesOfEachPairAlone) {
  FrozenCameras cameras(2);
  EXPECT_FALSE(cameras.find(0, {5, 6}));
  cameras.remember(0, {5, 6});
  EXPECT_FALSE(cameras.find(1, {5, 6}));
  EXPECT_FALSE(cameras.find(0, {6, 5}));
  EXPECT_EQ(cameras.find(0, {5, 7}), "left image");
  EXPECT_EQ(cameras.find(0, {7, 6}), "right image");
  EXPECT_EQ(cameras.find(0, {5, 6}), "left and right image");
  cameras.remember(1, {0, 6});
  EXPECT_FALSE(cameras.find(1, {0, 7})) << "uniform images";

  ArchiveWriter out;
  cameras.save(out);
  const Bytes saved = out.take();
  ArchiveReader in(saved);
  FrozenCameras restored(2);
  restored.restore(in);
  EXPECT_TRUE(in.finish("state"));
  EXPECT_EQ(restored.find(0, {5, 7}), "left image");
  EXPECT_EQ(restored.find(1, {0, 6}), "right image");
}

}  // namespace
}  // namespace spartan::internal
