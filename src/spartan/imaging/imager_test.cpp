#include "spartan/imaging/imager.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "spartan/image_io/image_io.h"
#include "spartan/imaging/internal/synthetic_frames_test.h"
#include "spartan/testing/synthetic_world.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using testing::camera;
using testing::frame_of;
using ::testing::HasSubstr;
using testing::kImageSize;
using testing::ramp;
using testing::rig_with;

TEST(Imager, ARectifiedPairIsNotChanged) {
  ImagingOptions options;
  options.contrast = false;
  const Rig rig = rig_with({});
  auto imager = Imager::create(rig, options, ThreadPool(1));
  ASSERT_TRUE(imager) << imager.error().message();
  const auto left = ramp<std::uint8_t>(1), right = ramp<std::uint8_t>(2);
  const auto pair =
      imager->process(frame_of(FrameImage::borrow(left.view(), {}), FrameImage::borrow(right.view(), {})));
  ASSERT_TRUE(pair) << pair.error().message();
  for (int y = 0; y < kImageSize.height; ++y) {
    for (int x = 0; x < kImageSize.width; ++x) {
      ASSERT_EQ(pair->left(x, y), left(x, y));
      ASSERT_EQ(pair->right(x, y), right(x, y));
    }
  }
  EXPECT_TRUE(pair->left_mask.empty());
  EXPECT_EQ(pair->stamp, Stamp{42});
  EXPECT_EQ(pair->geometry, imager->geometry("stereo"));
  EXPECT_NEAR(pair->geometry.baseline_m, 0.1, 1e-12);
  EXPECT_LT((pair->body_from_left.matrix() - optical_from_forward().inverse().matrix()).norm(), 1e-12);
}

TEST(Imager, RejectsFramesThatContradictTheRig) {
  auto imager = Imager::create(rig_with({}), {}, ThreadPool(1));
  ASSERT_TRUE(imager);
  const auto good = FrameImage::own(ramp<std::uint8_t>(1), {});
  const auto rejection = [&](const StereoFrame& frame) {
    const auto pair = imager->process(frame);
    EXPECT_FALSE(pair);
    EXPECT_EQ(pair.error().code, ErrorCode::frame_rejected);
    return pair.error().message();
  };
  const auto small = FrameImage::own(Image<std::uint8_t>(32, 48), {});
  EXPECT_THAT(rejection(frame_of(good, small)), HasSubstr("camera 'right' is 32 × 48"));
  EXPECT_THAT(rejection(frame_of(good, small)), HasSubstr("the rig specifies 64 × 48 gray of 8 bits"));
  const PixelFormat deep{PixelLayout::gray, 12};
  EXPECT_THAT(rejection(frame_of(FrameImage::own(ramp<std::uint16_t>(1), deep), good)),
              HasSubstr("gray of 12 bits, low alignment"));
  StereoFrame unknown = frame_of(good, good);
  unknown.pair = "mast";
  EXPECT_THAT(rejection(unknown), HasSubstr("no stereo pair 'mast'"));
}

TEST(Imager, ProcessesOneImageWhereTheOtherIsMissing) {
  ImagingOptions options;
  options.contrast_low_percent = 0;
  options.contrast_high_percent = 100;
  auto imager = Imager::create(rig_with({}), options, ThreadPool(1));
  ASSERT_TRUE(imager);
  // Half as bright, so that the gain for a whole pair is 2. Alone, both images are stretched to the full range.
  const auto bright = FrameImage::own(ramp<std::uint8_t>(2), {}), dark = FrameImage::own(ramp<std::uint8_t>(1), {});
  const auto left_alone = imager->process(frame_of(bright, {}));
  ASSERT_TRUE(left_alone) << left_alone.error().message();
  EXPECT_TRUE(left_alone->right.empty());
  EXPECT_EQ(left_alone->left(kImageSize.width - 1, kImageSize.height - 1), 255);
  const auto right_alone = imager->process(frame_of({}, dark));
  ASSERT_TRUE(right_alone) << right_alone.error().message();
  EXPECT_TRUE(right_alone->left.empty());
  EXPECT_EQ(right_alone->right(kImageSize.width - 1, kImageSize.height - 1), 255);
  const auto none = imager->process(frame_of({}, {}));
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::frame_rejected);
  EXPECT_THAT(none.error().message(), HasSubstr("both images are missing"));
}

TEST(Imager, RgbImagesOfAGrayCameraBecomeGray) {
  auto imager = Imager::create(rig_with({}), {}, ThreadPool(1));
  ASSERT_TRUE(imager);
  const auto gray = ramp<std::uint8_t>(2);
  Image<Rgb8> colour(kImageSize);
  for (int y = 0; y < kImageSize.height; ++y) {
    for (int x = 0; x < kImageSize.width; ++x) colour(x, y) = {gray(x, y), gray(x, y), gray(x, y)};
  }
  const auto from_gray =
      imager->process(frame_of(FrameImage::borrow(gray.view(), {}), FrameImage::borrow(gray.view(), {})));
  const auto expected = Image<std::uint8_t>::copy_of(from_gray->left);
  const PixelFormat rgb{PixelLayout::rgb, 8};
  const auto from_colour =
      imager->process(frame_of(FrameImage::borrow(gray.view(), {}), FrameImage::own(std::move(colour), rgb)));
  ASSERT_TRUE(from_colour) << from_colour.error().message();
  for (int y = 0; y < kImageSize.height; ++y) {
    for (int x = 0; x < kImageSize.width; ++x) ASSERT_EQ(from_colour->right(x, y), expected(x, y));
  }
  EXPECT_FALSE(Imager::create(rig_with(rgb), {}, ThreadPool(1))
                   ->process(frame_of(FrameImage::borrow(gray.view(), {}), FrameImage::borrow(gray.view(), {}))));
}

TEST(Imager, LoadsSelfMasks) {
  const testing::TemporaryFolder folder;
  Image<std::uint8_t> mask(kImageSize.width, kImageSize.height, 255);
  for (int x = 0; x < kImageSize.width; ++x) mask(x, 47) = 0;
  ASSERT_TRUE(write_png(folder.file("masks/left.png"), mask.view()));
  const auto good = FrameImage::own(ramp<std::uint8_t>(1), {});
  for (const bool rotated : {false, true}) {
    Rig rig = rig_with({}, {0, rotated ? 0.02 : 0, 0});
    rig.cameras[0].self_mask = "masks/left.png";
    auto imager = Imager::create(rig, {}, ThreadPool(1), folder.path());
    ASSERT_TRUE(imager) << imager.error().message();
    const auto pair = imager->process(frame_of(good, good));
    ASSERT_TRUE(pair);
    ASSERT_FALSE(pair->left_mask.empty());
    EXPECT_EQ(pair->left_mask(30, 47), 0);
    EXPECT_EQ(pair->left_mask(30, 20), 255);
    EXPECT_EQ(pair->right_mask.empty(), !rotated);
    rig.cameras[0].self_mask = "masks/missing.png";
    const auto rejected = Imager::create(rig, {}, ThreadPool(1), folder.path());
    ASSERT_FALSE(rejected);
    EXPECT_EQ(rejected.error().code, ErrorCode::configuration);
    EXPECT_THAT(rejected.error().message(), HasSubstr("missing.png"));
  }
}

// Both cameras see the same, except for the rover's body at the lower border of the right image.
TEST(Imager, UsesTheRequestedView) {
  const Rig rig = rig_with({}, {0, 0.02, 0});
  const auto good = FrameImage::own(ramp<std::uint8_t>(1), {});
  ImagingOptions options;
  options.view.policy = ViewPolicy::all_valid;
  options.view.width_px = 100;
  options.view.height_px = 50;
  auto imager = Imager::create(rig, options, ThreadPool(1));
  ASSERT_TRUE(imager) << imager.error().message();
  const auto pair = imager->process(frame_of(good, good));
  ASSERT_TRUE(pair);
  EXPECT_EQ(pair->left.size(), (ImageSize{100, 50}));
  EXPECT_TRUE(pair->left_mask.empty());
  EXPECT_TRUE(pair->right_mask.empty());
  options.view.focal_px = 10;
  const auto rejected = Imager::create(rig, options, ThreadPool(1));
  ASSERT_FALSE(rejected);
  EXPECT_EQ(rejected.error().code, ErrorCode::configuration);
}

TEST(Imager, RejectsAViewThatACameraDoesNotSee) {
  const auto rejection = [](const Rig& rig, const ImagingOptions& options, const std::string& mask_folder = {}) {
    const auto imager = Imager::create(rig, options, ThreadPool(1), mask_folder);
    EXPECT_FALSE(imager);
    if (imager) return std::string();
    EXPECT_EQ(imager.error().code, ErrorCode::configuration);
    return imager.error().message();
  };
  ImagingOptions options;
  options.view.focal_px = 1e-9;
  EXPECT_THAT(rejection(rig_with({}, {0, 0.02, 0}), options), HasSubstr("camera 'left' sees 0.0 % of the view"));
  const PinholeModel narrow{360, 360, 31.5, 23.5};  // converge by more than their field of view
  EXPECT_THAT(rejection(rig_of_one_pair("test", camera("left", {}, narrow), camera("right", {}, narrow),
                                        Pose(exp_so3({0, -0.4, 0}), {0.1, 0, 0}).inverse()),
                        {}),
              HasSubstr("camera 'left' sees 0.0 % of the view"));
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(write_png(folder.file("all.png"), Image<std::uint8_t>(kImageSize).view()));
  for (const double rotation : {0.0, 0.02}) {
    Rig rig = rig_with({}, {0, rotation, 0});
    rig.cameras[1].self_mask = "all.png";
    EXPECT_THAT(rejection(rig, {}, folder.path()), HasSubstr("camera 'right' sees 0.0 % of the view"));
  }
  // A view wider than the field of view is allowed.
  options.view.focal_px = 15;
  EXPECT_TRUE(Imager::create(rig_with({}, {0, 0.02, 0}), options, ThreadPool(1)));
}

TEST(Imager, ReportsTheDurationsOfItsSteps) {
  const PixelFormat bayer{PixelLayout::bayer_grbg, 8};
  const auto stages = [](const Rig& rig, const FrameImage& image, const ImagingOptions& options) {
    auto imager = Imager::create(rig, options, ThreadPool(1));
    EXPECT_TRUE(imager);
    std::vector<std::string> names;
    for (int i = 0; i < 2; ++i) {
      names.clear();
      const auto pair = imager->process(frame_of(image, image));
      for (const StageTime& time : pair->times) names.push_back(time.stage);
    }
    return names;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(stages(rig_with({}), FrameImage::own(ramp<std::uint8_t>(1), {}), {}), Names{"imaging.contrast"});
  Rig rig = rig_with(bayer, {0, 0.02, 0});
  rig.cameras[0].vignetting.coefficients = {-0.1};
  ImagingOptions options;
  options.local_contrast.enabled = true;
  EXPECT_EQ(stages(rig, FrameImage::own(ramp<std::uint8_t>(1), bayer), options),
            (Names{"imaging.debayer", "imaging.vignetting", "imaging.contrast", "imaging.local_contrast",
                   "imaging.rectify"}));
}

// Two distorting cameras that are rotated to each other view the synthetic world; the imager must reproduce what ideal
// cameras see.
TEST(Imager, RectifiesASyntheticDistortedPair) {
  const ImageSize size{320, 240};
  testing::SyntheticWorldOptions world_options;
  world_options.noise_levels = 0;
  world_options.texture_size_m = 0.015;  // coarse, as the image is interpolated twice
  const testing::SyntheticWorld world(world_options);
  Eigen::Matrix3d looking_down;
  looking_down << 0, -0.8, 0.6, -1, 0, 0, 0, -0.6, -0.8;
  const Pose world_from_left(looking_down, {0, 0, 0.6});

  Camera left = camera("left", {}, RadialTangentialModel({250, 250, 159.5, 119.5}, {-0.2, 0.04, 0, 0}));
  Camera right = left;
  right.name = "right";
  left.size = right.size = size;
  const Rig rig = rig_of_one_pair("test", left, right, Pose(exp_so3({0.02, 0.03, -0.02}), {0.1, 0.002, 0}).inverse());
  ImagingOptions options;
  options.contrast = false;
  auto imager = Imager::create(rig, options, ThreadPool(2));
  ASSERT_TRUE(imager) << imager.error().message();
  const RectifiedStereo view = imager->geometry("stereo");

  // The ideal view covers the field of view of the lenses; the distorted images are sampled from it.
  const Pose left_from_rectified =
      optical_from_forward() * imager
                                   ->process(frame_of(FrameImage::own(Image<std::uint8_t>(size), {}),
                                                      FrameImage::own(Image<std::uint8_t>(size), {})))
                                   ->body_from_left;
  const RectifiedStereo wide{{640, 480}, view.focal_px * 1.3, {319.5, 239.5}, view.baseline_m};
  const auto truth = world.render(wide, world_from_left * left_from_rectified, 1);
  const Pose right_from_rectified = rig.right_from_left(rig.pairs[0]) * left_from_rectified;
  const auto through_lens = [&](const Camera& lens_camera, const Eigen::Matrix3d& from_rectified,
                                const Image<std::uint8_t>& ideal) {
    Image<std::uint8_t> pixels(size);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const auto ray = unproject(lens_camera.model, {x, y});
        const Eigen::Vector3d p = wide.project(from_rectified.transpose() * ray->direction);
        const int px = static_cast<int>(p.x()), py = static_cast<int>(p.y());
        if (!(p.x() >= 0 && p.y() >= 0) || px + 1 >= 640 || py + 1 >= 480) continue;
        const double fx = p.x() - px, fy = p.y() - py;
        pixels(x, y) =
            static_cast<std::uint8_t>(std::lround((1 - fy) * ((1 - fx) * ideal(px, py) + fx * ideal(px + 1, py)) +
                                                  fy * ((1 - fx) * ideal(px, py + 1) + fx * ideal(px + 1, py + 1))));
      }
    }
    return pixels;
  };
  const auto seen_left = through_lens(left, left_from_rectified.rotation_matrix(), truth.left);
  const auto seen_right = through_lens(right, right_from_rectified.rotation_matrix(), truth.right);
  const auto pair =
      imager->process(frame_of(FrameImage::borrow(seen_left.view(), {}), FrameImage::borrow(seen_right.view(), {})));
  ASSERT_TRUE(pair);
  const auto ideal = world.render(view, world_from_left * left_from_rectified, 1);
  double left_sum = 0, right_sum = 0, shifted_sum = 0;
  int count = 0;
  for (int y = 40; y < 200; ++y) {
    for (int x = 40; x < 280; ++x) {
      left_sum += std::abs(pair->left(x, y) - ideal.left(x, y));
      right_sum += std::abs(pair->right(x, y) - ideal.right(x, y));
      shifted_sum += std::abs(pair->right(x + 1, y) - ideal.right(x, y));
      ++count;
    }
  }
  EXPECT_LT(left_sum / count, 2.0);
  EXPECT_LT(right_sum / count, 2.0);
  EXPECT_GT(shifted_sum, 2 * right_sum);
}

TEST(Imager, RefusesOptionsOutOfBoundsThatWereSetInCode) {
  ImagingOptions options;
  options.contrast_low_percent = -1;
  options.local_contrast.tiles = 0;
  const auto refused = Imager::create(rig_with({}), options, ThreadPool(1));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::configuration);
  EXPECT_THAT(refused.error().message(), HasSubstr("contrast_low_percent is -1"));
  EXPECT_THAT(refused.error().message(), HasSubstr("local_contrast.tiles is 0"));
}

TEST(ImagingOptions, AcceptsFormerKeysWithAWarning) {
  const std::string text = "balance: false\nlocal_contrast: {clip: 3}\nview: {policy: all_valid}\ndebayer: bilinear\n";
  const auto options = parse_options<ImagingOptions>(text, "options");
  ASSERT_TRUE(options) << options.error().message();
  EXPECT_FALSE(options->gain_compensation);
  EXPECT_EQ(options->local_contrast.clip_limit, 3);
  EXPECT_EQ(options->view.policy, ViewPolicy::all_valid);
  EXPECT_EQ(options->debayer, DebayerMethod::bilinear);
  EXPECT_EQ(read_options<ImagingOptions>(text, "options")->warnings.size(), 2U);
}

}  // namespace
}  // namespace spartan
