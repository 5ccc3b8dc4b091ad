#include "spartan/camera/internal/cameras/plugin_camera.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 66, kHeight = 48;  // a line is no multiple of four bytes

std::string rig_text(const std::string& pixels) {
  const std::string camera =
      fmt::format("size_px: [{}, {}], model: pinhole, focal_px: [50, 50], centre_px: [32.5, 23.5], axes: optical, {}",
                  kWidth, kHeight, pixels);
  return fmt::format(
      "schema: 1\ncameras:\n  l: {{{0} translation_m: [0, 0, 0]}}\n  r: {{{0} translation_m: [0.1, 0, 0]}}\n"
      "pairs:\n  p: {{left: l, right: r}}\n",
      camera);
}

#ifdef SPARTAN_HAS_GSTREAMER
// A different value at each place of each image.
Image<std::uint8_t> pattern(int number, int side) {
  Image<std::uint8_t> image(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x)
      image(x, y) = static_cast<std::uint8_t>((x * 3 + y * 7 + number * 31 + side * 101) % 256);
  }
  return image;
}

class Pipelines : public ::testing::Test {
 protected:
  static constexpr int kImages = 20;

  void SetUp() override {
    for (int side = 0; side < 2; ++side) {
      for (int i = 0; i < kImages; ++i) {
        const Image<std::uint8_t> image = pattern(i, side);
        ASSERT_TRUE(write_png(folder.file(fmt::format("{}/{:03}.png", side, i)), image.view()));
      }
    }
  }

  // A source of GStreamer that shows the images of a side at 100 Hz.
  std::string images_of(int side) const {
    return fmt::format(
        "multifilesrc location={}/{}/%03d.png stop-index={} caps=image/png,framerate=100/1 ! pngdec ! videoconvert",
        folder.path(), side, kImages - 1);
  }

  Result<std::unique_ptr<SampleStream>> open(const std::string& pipeline, const std::string& pixels = "") {
    OpenOptions options;
    options.rig_file = folder.file("rig.yaml");
    static_cast<void>(write_file_atomically(options.rig_file, rig_text(pixels)));
    return open_live_stream("gst:" + pipeline, options, {});
  }

  // All frames of the stream.
  static std::vector<StereoFrame> frames_of(SampleStream& stream) {
    std::vector<StereoFrame> frames;
    for (;;) {
      auto read = stream.read(std::chrono::seconds(10));
      if (!read || read->state != StreamRead::State::sample) break;
      if (auto* frame = std::get_if<StereoFrame>(&*read->sample)) frames.push_back(std::move(*frame));
    }
    return frames;
  }

  // A camera that runs now, at 40 Hz.
  static std::string running(const std::string& properties = "") {
    return fmt::format("videotestsrc is-live=true {} ! video/x-raw,format=GRAY8,width={},height={},framerate=40/1",
                       properties, kWidth, kHeight);
  }

  static void expect_frames_after_a_loss(SampleStream& stream) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    std::int64_t losses = 0;
    while (std::chrono::steady_clock::now() < until) {
      const auto read = stream.read(std::chrono::milliseconds(100));
      ASSERT_TRUE(read) << read.error().message();
      ASSERT_NE(read->state, StreamRead::State::end);
      const bool frame = read->state == StreamRead::State::sample && std::holds_alternative<StereoFrame>(*read->sample);
      if (frame && losses > 0) return;
      // Frames from before the loss may still wait to be read.
      if (read->state == StreamRead::State::none_yet) losses = stream.camera_reports()[0].cameras[0].losses;
    }
    FAIL() << losses << " losses, and no frame after them";
  }

  static void expect_patterns(const std::vector<StereoFrame>& frames) {
    ASSERT_EQ(frames.size(), static_cast<std::size_t>(kImages));
    for (int i = 0; i < kImages; ++i) {
      const StereoFrame& frame = frames[static_cast<std::size_t>(i)];
      for (int side = 0; side < 2; ++side) {
        const auto view = (side == 0 ? frame.left : frame.right).as<std::uint8_t>();
        const Image<std::uint8_t> wanted = pattern(i, side);
        for (int y = 0; y < kHeight; ++y) {
          ASSERT_TRUE(std::equal(&view(0, y), &view(0, y) + kWidth, &wanted(0, y))) << i << ' ' << side << ' ' << y;
        }
      }
      if (i == 0) continue;
      const double step_s = seconds_between(frames[static_cast<std::size_t>(i) - 1].left_stamp, frame.left_stamp);
      EXPECT_NEAR(step_s, 0.01, 0.009) << i;
      EXPECT_LT(std::abs(seconds_between(frame.left_stamp, frame.right_stamp)), 0.005);
    }
  }

  testing::TemporaryFolder folder;
};

TEST_F(Pipelines, TwoSinksDeliverEveryImageOfAFileUnchanged) {
  auto stream = open(images_of(0) + " ! appsink name=left " + images_of(1) + " ! appsink name=right");
  ASSERT_TRUE(stream) << stream.error().message();
  EXPECT_EQ((*stream)->control(), nullptr);
  expect_patterns(frames_of(**stream));
  const auto reports = (*stream)->camera_reports();
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_EQ(reports[0].pairs, kImages);
  EXPECT_EQ(reports[0].cameras[1].images, kImages);
}

// Rows of 198 bytes begin at multiples of four.
TEST_F(Pipelines, RowsOfColourMayBePadded) {
  const auto colour = [](int x, int y, int side) {
    const int value = x * 3 + y * 7 + side * 101;
    return Rgb8{static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value + 50),
                static_cast<std::uint8_t>(2 * value)};
  };
  for (int side = 0; side < 2; ++side) {
    Image<Rgb8> image(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) image(x, y) = colour(x, y, side);
    }
    for (int i = 0; i < kImages; ++i)
      ASSERT_TRUE(write_png(folder.file(fmt::format("{}/{:03}.png", side, i)), image.view()));
  }
  auto stream =
      open(images_of(0) + " ! appsink name=left " + images_of(1) + " ! appsink name=right", "pixel_layout: rgb,");
  ASSERT_TRUE(stream) << stream.error().message();
  const auto frames = frames_of(**stream);
  ASSERT_EQ(frames.size(), static_cast<std::size_t>(kImages));
  for (int side = 0; side < 2; ++side) {
    const auto view = (side == 0 ? frames[0].left : frames[0].right).as<Rgb8>();
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) ASSERT_EQ(view(x, y), colour(x, y, side)) << side << ' ' << x << ' ' << y;
    }
  }
}

TEST_F(Pipelines, ASideBySideImageIsCutInTwo) {
  auto stream =
      open(fmt::format("compositor name=both sink_1::xpos={} ! video/x-raw,format=AYUV ! videoconvert ! "
                       "appsink name=left {} ! both.sink_0 {} ! both.sink_1",
                       kWidth, images_of(0), images_of(1)));
  ASSERT_TRUE(stream) << stream.error().message();
  const auto frames = frames_of(**stream);
  ASSERT_GE(frames.size(), static_cast<std::size_t>(kImages) / 2);
  for (const StereoFrame& frame : frames) {
    EXPECT_EQ(frame.left.size(), (ImageSize{kWidth, kHeight}));
    EXPECT_EQ(frame.left_stamp, frame.right_stamp);
    // The compositor converts to YUV and back; 101 lie between the sides of the pattern.
    const auto left = frame.left.as<std::uint8_t>(), right = frame.right.as<std::uint8_t>();
    EXPECT_NEAR((right(20, 20) - left(20, 20) + 512) % 256, 101, 6);
  }
}

TEST_F(Pipelines, TakeACalibrationInAnyFormat) {
  OpenOptions options;
  options.rig_file = folder.file("calib.txt");
  ASSERT_TRUE(write_file_atomically(
      options.rig_file, fmt::format("cam0=[50 0 32.5; 0 50 23.5; 0 0 1]\ncam1=[50 0 32.5; 0 50 23.5; 0 0 1]\n"
                                    "doffs=0\nbaseline=100\nwidth={}\nheight={}\n",
                                    kWidth, kHeight)));
  auto stream = open_live_stream(
      "gst:" + images_of(0) + " ! appsink name=left " + images_of(1) + " ! appsink name=right", options, {});
  ASSERT_TRUE(stream) << stream.error().message();
  expect_patterns(frames_of(**stream));
}

TEST_F(Pipelines, DeliverTheFormatOfTheRig) {
  const auto source = [](const char* caps) {
    return fmt::format("videotestsrc num-buffers=5 ! {},width={},height={},framerate=50/1 ! appsink name=left", caps,
                       2 * kWidth, kHeight);
  };
  struct Case {
    const char *caps, *pixels;
    PixelFormat format;
  };
  for (const Case& c : {Case{"video/x-raw,format=GRAY16_LE", "bits: 12,", {PixelLayout::gray, 12}},
                        Case{"video/x-raw,format=RGB", "pixel_layout: rgb,", {PixelLayout::rgb, 8}},
                        Case{"video/x-bayer,format=grbg", "pixel_layout: bayer_grbg,", {PixelLayout::bayer_grbg, 8}}}) {
    auto stream = open(source(c.caps), c.pixels);
    ASSERT_TRUE(stream) << c.caps << stream.error().message();
    const auto frames = frames_of(**stream);
    ASSERT_EQ(frames.size(), 5u) << c.caps;
    EXPECT_EQ(frames[0].left.format(), c.format) << c.caps;
    EXPECT_EQ(frames[0].right.size(), (ImageSize{kWidth, kHeight}));
    if (c.format.bits != 8 || c.format.layout == PixelLayout::rgb) continue;
    // The colour bars of the test image: each line of the mosaic has several levels.
    const auto view = frames[0].right.as<std::uint8_t>();
    for (int y = 0; y < kHeight / 2; ++y) {
      const auto [darkest, brightest] = std::minmax_element(&view(0, y), &view(0, y) + kWidth);
      EXPECT_GT(*brightest, *darkest) << y;
    }
  }
}

// One of two cameras fails while the other one goes on.
TEST_F(Pipelines, TheLossOfOneOfTwoCamerasIsNoticed) {
  auto stream =
      open(running() + " ! appsink name=left " + running() + " ! identity error-after=40 ! appsink name=right");
  ASSERT_TRUE(stream) << stream.error().message();
  expect_frames_after_a_loss(**stream);
}

TEST_F(Pipelines, TheEndOfACameraIsALossAndThatOfAFileIsTheEnd) {
  auto stream = open(running("num-buffers=40") +
                     " ! tee name=both ! queue ! appsink name=left both. ! queue ! appsink "
                     "name=right");
  ASSERT_TRUE(stream) << stream.error().message();
  expect_frames_after_a_loss(**stream);
  auto one_ends = open(running() + " ! appsink name=left " + running("num-buffers=40") + " ! appsink name=right");
  ASSERT_TRUE(one_ends) << one_ends.error().message();
  expect_frames_after_a_loss(**one_ends);
  for (const std::string pace : {" ! appsink name=", " ! identity sync=true ! appsink name="}) {
    auto file = open(fmt::format("{0}{2}left {1}{2}right", images_of(0), images_of(1), pace));
    ASSERT_TRUE(file) << file.error().message();
    EXPECT_FALSE(frames_of(**file).empty());
    EXPECT_EQ((*file)->read(std::chrono::seconds(10))->state, StreamRead::State::end) << pace;
    EXPECT_EQ((*file)->camera_reports()[0].cameras[0].losses, 0) << pace;
  }
}

TEST_F(Pipelines, FailWithTheReason) {
  auto none = open("nosuchelement ! appsink name=left");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::read_error);
  EXPECT_THAT(none.error().message(), HasSubstr("nosuchelement"));
  EXPECT_THAT(open("videotestsrc ! appsink").error().message(), HasSubstr("no appsink named left"));
  EXPECT_THAT(open("filesrc location=/no/such/file ! appsink name=left").error().message(), HasSubstr("/no/such/file"));
  auto large = open("videotestsrc num-buffers=5 ! video/x-raw,format=GRAY8,width=640,height=480 ! appsink name=left");
  EXPECT_EQ(large.error().code, ErrorCode::read_error) << "images of another size are no frames";
}

#endif

TEST(CameraAddresses, AreChecked) {
  const auto error = [](const std::string& address, const std::string& rig) {
    OpenOptions options;
    options.rig_file = rig;
    const auto stream = open_live_stream(address, options, {});
    return stream ? std::string() : stream.error().message();
  };
  const testing::TemporaryFolder folder;
  const std::string rig = folder.file("rig.yaml");
  ASSERT_TRUE(write_file_atomically(rig, rig_text("")));
  EXPECT_THAT(error("gst:videotestsrc", ""), HasSubstr("--rig"));
  EXPECT_THAT(error("aravis:one", rig), HasSubstr("aravis:LEFT,RIGHT"));
  EXPECT_THAT(error("aravis:one,", rig), HasSubstr("aravis:LEFT,RIGHT"));
  EXPECT_THAT(error("live:" + rig, ""), HasSubstr("no camera has a driver"));
  EXPECT_THAT(error("live:" + rig, "other.yaml"), HasSubstr("omit --rig, or use live:other.yaml"));
  EXPECT_THAT(error("live:" + rig + ".missing", ""), HasSubstr("rig.yaml.missing"));
  EXPECT_THAT(error("v4l:0", rig), HasSubstr("is not the address of a live stream"));
  ASSERT_TRUE(write_file_atomically(rig, rig_text("driver: {source: 'v4l:0'},")));
  EXPECT_THAT(error("live:" + rig, ""), HasSubstr("is of no known kind"));
}

}  // namespace
}  // namespace spartan
