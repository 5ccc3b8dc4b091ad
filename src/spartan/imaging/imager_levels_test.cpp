// Gray levels of the working images: depth, vignetting, gain, contrast.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "spartan/image_io/image_io.h"
#include "spartan/imaging/imager.h"
#include "spartan/imaging/internal/synthetic_frames_test.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using testing::camera;
using testing::frame_of;
using testing::kImageSize;
using testing::ramp;
using testing::rig_with;

TEST(Imager, EveryDepthAndLayoutGivesTheSameWorkingImage) {
  // A gray world: all layouts must agree but for the interpolation at the borders of a mosaic.
  const auto working_image = [](const PixelFormat& format, const FrameImage& image) {
    auto imager = Imager::create(rig_with(format), {}, ThreadPool(2));
    EXPECT_TRUE(imager);
    const auto pair = imager->process(frame_of(image, image));
    EXPECT_TRUE(pair) << pair.error().message();
    return Image<std::uint8_t>::copy_of(pair->left);
  };
  const PixelFormat bayer12{PixelLayout::bayer_grbg, 12, BitAlignment::high}, rgb16{PixelLayout::rgb, 16},
      gray10{PixelLayout::gray, 10};
  Image<Rgb16> colour(kImageSize);
  for (int y = 0; y < kImageSize.height; ++y) {
    for (int x = 0; x < kImageSize.width; ++x) {
      const auto level = static_cast<std::uint16_t>((x + y) * 300);
      colour(x, y) = {level, level, level};
    }
  }
  const auto plain = working_image({}, FrameImage::own(ramp<std::uint8_t>(2), {}));
  const auto gray = working_image(gray10, FrameImage::own(ramp<std::uint16_t>(7), gray10));
  const auto rgb = working_image(rgb16, FrameImage::own(std::move(colour), rgb16));
  const auto bayer = working_image(bayer12, FrameImage::own(ramp<std::uint16_t>(30 * 16), bayer12));
  for (int y = 1; y + 1 < kImageSize.height; ++y) {
    for (int x = 1; x + 1 < kImageSize.width; ++x) {
      ASSERT_NEAR(gray(x, y), plain(x, y), 1);
      ASSERT_NEAR(rgb(x, y), plain(x, y), 1);
      ASSERT_NEAR(bayer(x, y), plain(x, y), 3);
    }
  }
}

TEST(Imager, TheSelfMaskIsExcludedFromGainCompensation) {
  const testing::TemporaryFolder folder;
  Image<std::uint8_t> scene(kImageSize), with_body(kImageSize), mask(kImageSize.width, kImageSize.height, 255);
  for (const double fraction : {0.1, 0.2, 0.3}) {
    for (int y = 0; y < kImageSize.height; ++y) {
      for (int x = 0; x < kImageSize.width; ++x) {
        const bool body = y >= (1 - fraction) * kImageSize.height;
        scene(x, y) = static_cast<std::uint8_t>(90 + (x * 37 + y * 11) % 101);
        with_body(x, y) = body ? 25 : scene(x, y);
        mask(x, y) = body ? 0 : 255;
      }
    }
    ASSERT_TRUE(write_png(folder.file("body.png"), mask.view()));
    for (const double rotation : {0.0, 0.002}) {
      Rig rig = rig_with({}, {0, rotation, 0});
      rig.cameras[1].self_mask = "body.png";
      auto imager = Imager::create(rig, {}, ThreadPool(1), folder.path());
      ASSERT_TRUE(imager) << imager.error().message();
      const auto pair =
          imager->process(frame_of(FrameImage::own(scene.clone(), {}), FrameImage::own(with_body.clone(), {})));
      ASSERT_TRUE(pair);
      double sum = 0;
      for (int y = 2; y < 30; ++y) {
        for (int x = 2; x < 60; ++x) sum += pair->right(x, y) - pair->left(x, y);
      }
      EXPECT_NEAR(sum / (28 * 58), 0, 1) << fraction << " of the image, rotated by " << rotation;
    }
  }
}

TEST(Imager, PixelsOutsideOfTheViewDoNotAffectTheContrast) {
  const CameraModel fisheye = EquidistantModel({20, 20, 31.5, 23.5}, {});  // 88° at 31 px
  const Rig rig = rig_of_one_pair("test", camera("left", {}, fisheye), camera("right", {}, fisheye),
                                  Pose(Eigen::Quaterniond::Identity(), {0.1, 0, 0}).inverse());
  auto imager = Imager::create(rig, {}, ThreadPool(1));
  ASSERT_TRUE(imager) << imager.error().message();
  const auto seen_with = [&](int surround) {
    auto pixels = ramp<std::uint8_t>(1);
    for (int y = 0; y < kImageSize.height; ++y) {
      for (int x = 0; x < kImageSize.width; ++x) {
        if (std::hypot(x - 31.5, y - 23.5) > 33) pixels(x, y) = static_cast<std::uint8_t>(surround);
      }
    }
    const auto image = FrameImage::own(std::move(pixels), {});
    return Image<std::uint8_t>::copy_of(imager->process(frame_of(image, image))->left);
  };
  const auto black = seen_with(0), white = seen_with(255);
  for (int y = 0; y < kImageSize.height; ++y) {
    for (int x = 0; x < kImageSize.width; ++x) ASSERT_EQ(black(x, y), white(x, y)) << x << ", " << y;
  }
}

TEST(Imager, CorrectsTheVignetting) {
  Rig rig = rig_with({});
  ImagingOptions options;
  options.contrast = options.gain_compensation = false;
  const auto flat = FrameImage::own(Image<std::uint8_t>(kImageSize.width, kImageSize.height, 100), {});
  const auto corner = [&](bool undo) -> int {
    options.vignetting = undo;
    auto imager = Imager::create(rig, options, ThreadPool(2));
    EXPECT_TRUE(imager);
    const auto pair = imager->process(frame_of(flat, flat));
    EXPECT_EQ(pair->right(0, 0), 100) << "the right camera has none";
    EXPECT_EQ(pair->left(32, 24), 100);
    return pair->left(0, 0);
  };
  rig.cameras[0].vignetting.coefficients = {-0.5};
  EXPECT_EQ(corner(false), 100);
  EXPECT_NEAR(corner(true), 200, 2);
  rig.cameras[0].vignetting.coefficients = {-2};
  EXPECT_FALSE(Imager::create(rig, options, ThreadPool(1)));
}

TEST(Imager, CompensatesTheGainBetweenTheCameras) {
  const PixelFormat format{PixelLayout::gray, 12};
  ImagingOptions options;
  for (const bool gain_compensation : {false, true}) {
    options.gain_compensation = gain_compensation;
    auto imager = Imager::create(rig_with(format), options, ThreadPool(2));
    ASSERT_TRUE(imager);
    const auto pair = imager->process(
        frame_of(FrameImage::own(ramp<std::uint16_t>(30), format), FrameImage::own(ramp<std::uint16_t>(20), format)));
    ASSERT_TRUE(pair);
    const int difference = std::abs(pair->left(50, 30) - pair->right(50, 30));
    EXPECT_TRUE(gain_compensation ? difference <= 1 : difference > 30) << difference;
  }
}

// An 8-bit image would be rounded before and after the interpolation: up to a whole level from the true one.
TEST(Imager, DeepImagesAreRoundedTo8BitsOnceAfterTheInterpolation) {
  const PixelFormat format{PixelLayout::gray, 12};
  const Rig rig = rig_with(format, {0.03, -0.05, 0.04});
  ImagingOptions options;
  options.contrast = false;
  auto imager = Imager::create(rig, options, ThreadPool(2));
  ASSERT_TRUE(imager);
  Image<std::uint16_t> image(kImageSize);
  for (int y = 0; y < kImageSize.height; ++y) {
    for (int x = 0; x < kImageSize.width; ++x) image(x, y) = static_cast<std::uint16_t>(41 * x + 13 * y + 100);
  }
  const FrameImage frame = FrameImage::own(std::move(image), format);
  const auto pair = imager->process(frame_of(frame, frame));
  ASSERT_TRUE(pair);
  const Eigen::Matrix3d camera_from_rectified =
      (rig.body_from_camera("left").rotation().inverse() * pair->body_from_left.rotation()).toRotationMatrix();
  const RectifiedStereo& g = pair->geometry;
  double worst = 0;
  int seen = 0;
  for (int y = 0; y < pair->left.height(); ++y) {
    for (int x = 0; x < pair->left.width(); ++x) {
      if (!pair->left_mask.empty() && pair->left_mask(x, y) == 0) continue;
      const Eigen::Vector3d ray = camera_from_rectified * Eigen::Vector3d((x - g.centre_px.x()) / g.focal_px,
                                                                          (y - g.centre_px.y()) / g.focal_px, 1);
      const double u = 60 * ray.x() / ray.z() + 32, v = 60 * ray.y() / ray.z() + 24;
      worst = std::max(worst, std::abs(pair->left(x, y) - (41 * u + 13 * v + 100) * 255 / 4095));
      ++seen;
    }
  }
  EXPECT_GT(seen, 1000);
  EXPECT_LT(worst, 0.6) << "gray levels";
}

TEST(Imager, AppliesClaheAfterTheStretch) {
  ImagingOptions options;
  const auto image = FrameImage::own(ramp<std::uint8_t>(1), {});
  const auto result = [&](bool local, double clip) {
    options.local_contrast = {local, 4, clip};
    auto imager = Imager::create(rig_with({}), options, ThreadPool(2));
    EXPECT_TRUE(imager);
    return Image<std::uint8_t>::copy_of(imager->process(frame_of(image, image))->left);
  };
  const auto plain = result(false, 2), equalised = result(true, 40);
  EXPECT_GT(equalised(8, 11) - equalised(4, 4), plain(8, 11) - plain(4, 4));
}

}  // namespace
}  // namespace spartan
