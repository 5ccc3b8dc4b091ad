#include "spartan/camera/recording_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "spartan/camera/recording.h"
#include "spartan/image_io/image_io.h"
#include "spartan/numerics/random.h"
#include "spartan/testing/tiny_recordings.h"

namespace spartan {
namespace {

namespace fs = std::filesystem;
using testing::collect_samples;
using testing::CollectedSamples;
using ::testing::HasSubstr;
using testing::TemporaryFolder;
using testing::tiny_image;
using testing::tiny_rig;

// --- random recordings ---

constexpr std::array kBayer{PixelLayout::gray, PixelLayout::bayer_rggb, PixelLayout::bayer_grbg,
                            PixelLayout::bayer_gbrg, PixelLayout::bayer_bggr};

Pose random_pose(Random& random) {
  const auto three = [&] { return Eigen::Vector3d(random.normal(), random.normal(), random.normal()); };
  const Eigen::Vector3d turn = three();
  return Pose(exp_so3(turn), three());
}

// One or two pairs on the body or on a mast; cameras of any size, pixel layout and bit depth.
Rig random_rig(Random& random) {
  Rig rig;
  rig.name = "random";
  rig.pan_tilt_units = {{"mast", random_pose(random), random.normal(), random.normal()}};
  for (std::uint32_t p = 0; p < 1 + random.below(2); ++p) {
    Camera camera;
    camera.size = {4 + static_cast<int>(random.below(20)), 4 + static_cast<int>(random.below(20))};
    camera.model = PinholeModel{random.uniform(10, 30), random.uniform(10, 30), 8, 8};
    camera.pixel_format.layout = kBayer[random.below(kBayer.size())];
    camera.pixel_format.bits = 8 + static_cast<int>(random.below(9));
    if (camera.pixel_format.bits > 8 && random.below(2)) camera.pixel_format.alignment = BitAlignment::high;
    camera.mount = random.below(2) ? "mast" : "body";
    const std::string name = "pair" + std::to_string(p);
    for (const char* side : {"_left", "_right"}) {
      camera.name = name + side;
      camera.mount_from_camera = random_pose(random);
      rig.cameras.push_back(camera);
    }
    rig.pairs.push_back({name, name + "_left", name + "_right", 0, p == 0});
  }
  return rig;
}

FrameImage random_image(Random& random, ImageSize size, PixelFormat format) {
  if (format.layout == PixelLayout::rgb) {
    Image<Rgb8> image(size);
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        const auto level = [&] { return static_cast<std::uint8_t>(random.below(256)); };
        image(x, y) = {level(), level(), level()};
      }
    }
    return FrameImage::own(std::move(image), format);
  }
  if (format.bits == 8) return FrameImage::own(tiny_image(random.next(), size), format);
  Image<std::uint16_t> image(size);
  const int shift = format.alignment == BitAlignment::high ? 16 - format.bits : 0;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x)
      image(x, y) = static_cast<std::uint16_t>(random.below(1U << static_cast<unsigned>(format.bits)) << shift);
  }
  return FrameImage::own(std::move(image), format);
}

StereoFrame random_frame(Random& random, const Rig& rig, const StereoPair& pair, Stamp stamp) {
  const Camera& camera = *rig.find_camera(pair.left);
  PixelFormat format = camera.pixel_format;
  format.bits = 8 + static_cast<int>(random.below(9));  // a frame may use fewer bits than its camera
  if (format.bits == 8) format.alignment = BitAlignment::low;
  if (format.layout == PixelLayout::gray && random.below(4) == 0) format = {PixelLayout::rgb, 8, BitAlignment::low};
  StereoFrame frame;
  frame.pair = pair.name;
  frame.position_id = static_cast<std::int64_t>(random.below(5)) - 1;
  frame.left_stamp = stamp;
  frame.right_stamp = Stamp{stamp.ns + static_cast<std::int64_t>(random.below(2'000'000)) - 1'000'000};
  frame.left = random_image(random, camera.size, format);
  frame.right = random_image(random, camera.size, format);
  frame.pan_rad = random.normal();
  frame.tilt_rad = random.normal();
  frame.exposure_us = random.uniform(0, 1e5);
  frame.gain = random.uniform(0, 10);
  return frame;
}

Sample random_sample(Random& random, const Rig& rig, Stamp stamp) {
  const auto number = [&] { return random.normal() * std::pow(10, random.uniform(-12, 12)); };
  switch (random.below(6)) {
    case 0:
      return ImuSample{stamp, {number(), number(), number()}, {number(), number(), number()}};
    case 1:
      return WheelSample{stamp, number(), number()};
    case 2:
      return CompassSample{stamp, number(), number()};
    case 3:
      return InclinometerSample{stamp, number(), number(), number()};
    default:
      return random_frame(random, rig, rig.pairs[random.below(static_cast<std::uint32_t>(rig.pairs.size()))], stamp);
  }
}

bool same(const Sample& a, const Sample& b) {
  if (a.index() != b.index() || stamp_of(a) != stamp_of(b)) return false;
  if (const auto* x = std::get_if<StereoFrame>(&a)) {
    const auto& y = std::get<StereoFrame>(b);
    return x->frame_id == y.frame_id && x->position_id == y.position_id && x->pair == y.pair &&
           x->right_stamp == y.right_stamp && testing::same_image(x->left, y.left) &&
           testing::same_image(x->right, y.right) && x->pan_rad == y.pan_rad && x->tilt_rad == y.tilt_rad &&
           x->exposure_us == y.exposure_us && x->gain == y.gain;
  }
  if (const auto* x = std::get_if<ImuSample>(&a)) {
    const auto& y = std::get<ImuSample>(b);
    return x->gyro_rad_s == y.gyro_rad_s && x->accel_m_s2 == y.accel_m_s2;
  }
  if (const auto* x = std::get_if<WheelSample>(&a)) {
    const auto& y = std::get<WheelSample>(b);
    return x->left_m == y.left_m && x->right_m == y.right_m;
  }
  if (const auto* x = std::get_if<CompassSample>(&a)) {
    const auto& y = std::get<CompassSample>(b);
    return x->heading_rad == y.heading_rad && x->sigma_rad == y.sigma_rad;
  }
  const auto &x = std::get<InclinometerSample>(a), &y = std::get<InclinometerSample>(b);
  return x.roll_rad == y.roll_rad && x.pitch_rad == y.pitch_rad && x.sigma_rad == y.sigma_rad;
}

Status add(RecordingWriter& writer, const Sample& sample) {
  return std::visit(
      [&](const auto& s) -> Status {
        if constexpr (requires { writer.add(s); }) return writer.add(s);
        return {};
      },
      sample);
}

RC_GTEST_PROP(RecordingWriter, ReadsBackBitForBit, ()) {
  Random random(*rc::gen::arbitrary<std::uint32_t>());
  const Rig rig = random_rig(random);
  const TemporaryFolder folder;
  const RecordingOptions about{
      "a name: #1", "it's \"quoted\"\nand long", 3.71, {{.accel_walk_m_s3_sqrt_hz = 5e-5}, {1e-6}, {2e-3, 1e-6}}};
  const ImageFiles images = random.below(2) == 0 ? ImageFiles::png : ImageFiles::pnm;
  auto writer = random.below(2) == 0 ? RecordingWriter::create(folder.path(), rig, about)
                                     : RecordingWriter::create_batched(folder.path(), rig, about, images);
  RC_ASSERT(writer.has_value());
  std::vector<Sample> written;
  Stamp stamp{static_cast<std::int64_t>(random.next()) - 2'000'000'000};
  const int count = *rc::gen::inRange(1, 25);
  for (int i = 0; i < count; ++i) {
    stamp.ns += 1 + static_cast<std::int64_t>(random.below(3'000'000'000));
    // A recording needs at least one frame.
    Sample sample = i == 0 ? Sample(random_frame(random, rig, rig.pairs[0], stamp)) : random_sample(random, rig, stamp);
    if (auto* frame = std::get_if<StereoFrame>(&sample)) frame->frame_id = i;
    const Status status = add(*writer, sample);
    RC_ASSERT(status.has_value());
    if (random.below(4) == 0) RC_ASSERT(writer->sync().has_value());
    written.push_back(std::move(sample));
  }
  RC_ASSERT(writer->finish().has_value());

  auto source = open_recording(folder.path());
  RC_ASSERT(source.has_value());
  RC_ASSERT((*source)->info().rig == rig);
  RC_ASSERT((*source)->info().name == "a name: #1");
  RC_ASSERT((*source)->info().description == "it's \"quoted\"\nand long");
  RC_ASSERT((*source)->info().gravity_m_s2 == 3.71);
  RC_ASSERT((*source)->info().noise.imu.accel_walk_m_s3_sqrt_hz == 5e-5);
  RC_ASSERT((*source)->info().noise.compass.offset_walk_rad_sqrt_hz == 1e-6);
  RC_ASSERT((*source)->info().noise.inclinometer.bias_rad == 2e-3);
  const CollectedSamples played = collect_samples(**source);
  RC_ASSERT(played.error == "");
  RC_ASSERT(played.all.size() == written.size());
  for (std::size_t i = 0; i < written.size(); ++i) RC_ASSERT(same(played.all[i], written[i]));
}

// --- truth ---

TEST(RecordingWriter, WritesTheGroundTruth) {
  const TemporaryFolder folder;
  testing::write_tiny_spartan(folder, 1);
  fs::remove_all(folder.path() + "/images");
  const TemporaryFolder other;
  auto writer = RecordingWriter::create(other.path(), tiny_rig(), {});
  ASSERT_TRUE(writer);
  Rig true_rig = tiny_rig();
  true_rig.name = "true";
  const Trajectory poses{{Stamp{5}, Pose::from_translation({1, 2, 3})}};
  ASSERT_TRUE(writer->write_truth(true_rig, poses));
  Image<float> disparity(3, 1);
  disparity(0, 0) = 1.5F;
  disparity(1, 0) = std::numeric_limits<float>::quiet_NaN();
  disparity(2, 0) = 1e6F;
  Image<std::uint8_t> mask(3, 1);
  mask(0, 0) = 255;
  mask(1, 0) = 128;
  ASSERT_TRUE(writer->write_truth_disparity("stereo", Stamp{5}, disparity, mask));
  EXPECT_EQ(testing::content_of(other.path() + "/truth/poses.tum"), to_tum(poses));
  EXPECT_THAT(testing::content_of(other.path() + "/truth/rig.yaml"), HasSubstr("true"));
  const auto fixed = read_image(other.path() + "/truth/disparity/stereo/5.png");
  ASSERT_TRUE(fixed);
  EXPECT_EQ(fixed->as<std::uint16_t>()(0, 0), 384);
  EXPECT_EQ(fixed->as<std::uint16_t>()(1, 0), 0) << "unknown";
  EXPECT_EQ(fixed->as<std::uint16_t>()(2, 0), 65535) << "the largest value of the format";
  const auto seen = read_image(other.path() + "/truth/mask/stereo/5.png");
  ASSERT_TRUE(seen);
  EXPECT_EQ(seen->as<std::uint8_t>()(1, 0), 128);
}

TEST(RecordingWriter, GroundTruthIsFoundByTheReader) {
  const TemporaryFolder folder;
  testing::write_tiny_spartan(folder, 2);
  folder.write("truth/poses.tum", "0 0 0 0 0 0 0 1\n");
  EXPECT_EQ((*open_recording(folder.path()))->info().truth_file, folder.path() + "/truth/poses.tum");
}

// --- faults ---

class Rejections : public ::testing::Test {
 protected:
  Rejections() : writer_(RecordingWriter::create(folder_.path(), tiny_rig(), {}).value()) {}
  static StereoFrame frame(std::int64_t ns) {
    StereoFrame frame;
    frame.pair = "stereo";
    frame.left_stamp = frame.right_stamp = Stamp{ns};
    frame.left = FrameImage::own(tiny_image(1), {});
    frame.right = FrameImage::own(tiny_image(2), {});
    return frame;
  }
  template <class T>
  std::string rejection(const T& sample) {
    const Status status = writer_.add(sample);
    if (status) return "no fault";
    EXPECT_EQ(status.error().code, ErrorCode::input);
    return status.error().message();
  }
  TemporaryFolder folder_;
  RecordingWriter writer_;
};

TEST_F(Rejections, StampsMustIncreaseWithinAKind) {
  ASSERT_TRUE(writer_.add(frame(1'000'000'000)));
  EXPECT_THAT(rejection(frame(1'000'000'000)),
              HasSubstr("stereo at 1.000000000 s does not come after the previous stamp"));
  EXPECT_THAT(rejection(frame(999)), HasSubstr("does not come after"));
  ASSERT_TRUE(writer_.add(ImuSample{Stamp{5}, {}, {}})) << "each kind has its own order";
  EXPECT_THAT(rejection(ImuSample{Stamp{5}, {0, 0, 0}, {0, 0, 0}}), HasSubstr("imu.csv at 0.000000005 s"));
  EXPECT_THAT(rejection(ImuSample{Stamp{std::numeric_limits<std::int64_t>::max()}, {0, 0, 0}, {0, 0, 0}}),
              HasSubstr("out of range"));
  ASSERT_TRUE(writer_.add(frame(2'000'000'000)));
  ASSERT_TRUE(writer_.finish());
  const CollectedSamples played = collect_samples(**open_recording(folder_.path()));
  EXPECT_EQ(played.frames.size(), 2U) << "a rejected sample is not recorded";
  EXPECT_TRUE(testing::same_image(played.frames[0].left, frame(0).left));
}

TEST_F(Rejections, NumbersMustBeFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  EXPECT_THAT(rejection(ImuSample{Stamp{5}, {0, nan, 0}, {0, 0, 0}}), HasSubstr("not finite"));
  EXPECT_THAT(rejection(WheelSample{Stamp{5}, inf, 0}), HasSubstr("not finite"));
  EXPECT_THAT(rejection(CompassSample{Stamp{5}, 0, nan}), HasSubstr("not finite"));
  EXPECT_THAT(rejection(InclinometerSample{Stamp{5}, 0, -inf, 0}), HasSubstr("not finite"));
  for (double StereoFrame::*number :
       {&StereoFrame::pan_rad, &StereoFrame::tilt_rad, &StereoFrame::exposure_us, &StereoFrame::gain}) {
    StereoFrame bad = frame(5);
    bad.*number = nan;
    EXPECT_THAT(rejection(bad), HasSubstr("not finite"));
  }
  EXPECT_FALSE(fs::exists(folder_.path() + "/sensors")) << "no valid sample was added";
}

TEST_F(Rejections, ImagesMustFitTheRig) {
  StereoFrame bad = frame(5);
  bad.pair = "wide";
  EXPECT_THAT(rejection(bad), HasSubstr("no pair 'wide'"));
  bad = frame(5);
  bad.right = FrameImage::own(tiny_image(1, {3, 4}), {});
  EXPECT_THAT(rejection(bad),
              HasSubstr("image of 'right' at 0.000000005 s is 3x4, but camera 'right' in the rig is 24x16"));
  bad = frame(5);
  bad.left = bad.left.with_format({PixelLayout::bayer_rggb, 8, BitAlignment::low});
  EXPECT_THAT(rejection(bad), HasSubstr("but the layout of camera 'left' in the rig is gray"));
  bad = frame(5);
  bad.left = FrameImage::own(Image<std::uint16_t>(testing::kTinySize), {PixelLayout::gray, 12, BitAlignment::low});
  EXPECT_THAT(rejection(bad), HasSubstr("left and right images of different bit depth"));
  bad.left = bad.right =
      FrameImage::own(Image<std::uint16_t>(testing::kTinySize), {PixelLayout::gray, 12, BitAlignment::high});
  EXPECT_THAT(rejection(bad), HasSubstr("another bit alignment"));
  bad.left = bad.right = FrameImage::own(Image<Rgb16>(testing::kTinySize), {PixelLayout::rgb, 16, BitAlignment::low});
  EXPECT_THAT(rejection(bad), HasSubstr("more than 8 bits"));
  EXPECT_TRUE(fs::is_empty(folder_.path() + "/images/stereo"));
}

TEST_F(Rejections, AnUnfinishedRecordingDoesNotOpen) {
  ASSERT_TRUE(writer_.add(frame(5)));
  const auto source = open_recording(folder_.path());
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().code, ErrorCode::input);
  EXPECT_THAT(source.error().message(), HasSubstr("was not finished"));
}

TEST(RecordingWriterFolder, IsNotOverwritten) {
  const TemporaryFolder folder;
  folder.write("recording/mine.txt", "mine");
  for (const char* name : {"/recording", "/recording/mine.txt"}) {
    const auto writer = RecordingWriter::create(folder.path() + name, tiny_rig(), {});
    ASSERT_FALSE(writer) << name;
    EXPECT_EQ(writer.error().code, ErrorCode::output);
    EXPECT_THAT(writer.error().message(), HasSubstr("already exists"));
  }
  EXPECT_EQ(testing::content_of(folder.path() + "/recording/mine.txt"), "mine");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path() + "/recording"), {}), 1);
}

TEST(RecordingWriterFolder, ReportsWhereItCannotBeCreated) {
  const TemporaryFolder folder;
  folder.write("file", "");
  for (const std::string& path : {folder.path() + "/file/recording", std::string("/proc/none/recording")}) {
    const auto writer = RecordingWriter::create(path, tiny_rig(), {});
    ASSERT_FALSE(writer) << path;
    EXPECT_EQ(writer.error().code, ErrorCode::output);
    EXPECT_THAT(writer.error().message(), HasSubstr(path));
  }
}

TEST(RecordingWriterFolder, IsNotCreatedForAnInvalidRig) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/recording";
  Rig rig = tiny_rig();
  rig.cameras[0].size = {0, 0};
  EXPECT_EQ(RecordingWriter::create(path, rig, {}).error().code, ErrorCode::configuration);
  for (const char* name : {"a,b", "../up", "a/b", "two words", ""}) {
    rig = tiny_rig();
    rig.pairs[0].name = name;
    EXPECT_EQ(RecordingWriter::create(path, rig, {}).error().code, ErrorCode::configuration) << name;
  }
  EXPECT_FALSE(fs::exists(path));
}

TEST(RecordingWriterFolder, IsNotCreatedForADescriptionThatTheReaderRefuses) {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/recording";
  RecordingOptions options;
  options.noise.imu.gyro_bias_rad_s = 2;
  const auto writer = RecordingWriter::create(path, tiny_rig(), options);
  ASSERT_FALSE(writer);
  EXPECT_EQ(writer.error().code, ErrorCode::configuration);
  EXPECT_THAT(writer.error().message(), HasSubstr("imu_noise.gyro_bias_rad_s is 2, must be between 0 and 1"));
  EXPECT_FALSE(fs::exists(path));
}

TEST(RecordingWriterFolder, ReportsAFullDisk) {
  const TemporaryFolder folder;
  auto writer = RecordingWriter::create(folder.path() + "/r", tiny_rig(), {});
  ASSERT_TRUE(writer);
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full";
  fs::create_directory(folder.path() + "/r/sensors");
  fs::create_symlink("/dev/full", folder.path() + "/r/sensors/imu.csv");
  ASSERT_TRUE(writer->add(ImuSample{Stamp{1}, {0, 0, 0}, {0, 0, 0}})) << "still buffered";
  const Status finished = writer->finish();
  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().code, ErrorCode::output);
  EXPECT_THAT(finished.error().message(), HasSubstr("imu.csv: cannot be written"));
  EXPECT_FALSE(fs::exists(folder.path() + "/r/recording.yaml"));
}

}  // namespace
}  // namespace spartan
