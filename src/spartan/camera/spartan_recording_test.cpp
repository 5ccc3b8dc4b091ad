// Spartan recordings: Recording reads what RecordingWriter writes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cstring>
#include <filesystem>
#include <limits>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/recording.h"
#include "spartan/camera/recording_writer.h"
#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"
#include "spartan/numerics/random.h"
#include "spartan/testing/doc_example.h"
#include "spartan/testing/temporary_folder.h"

namespace spartan {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing::TemporaryFolder;

constexpr ImageSize kSize{24, 16};

Rig rover(PixelFormat format = {}) {
  Rig rig;
  rig.name = "rover";
  rig.pan_tilt_units = {{"mast", Pose::from_translation({0, 0, 1})}};
  for (const char* pair : {"front", "mast"}) {
    for (const char* side : {"left", "right"}) {
      Camera camera;
      camera.name = std::string(pair) + "_" + side;
      camera.size = kSize;
      camera.model = PinholeModel{20, 20, 11.5, 7.5};
      camera.pixel_format = format;
      if (pair == std::string("mast")) camera.mount = "mast";
      const double y = side == std::string("left") ? 0.05 : -0.05;
      camera.mount_from_camera = Pose::from_translation({0, y, 0}) * optical_from_forward().inverse();
      rig.cameras.push_back(camera);
    }
  }
  rig.pairs = {{"front", "front_left", "front_right"}, {"mast", "mast_left", "mast_right", 0, false}};
  return rig;
}

FrameImage noise(PixelFormat format, std::uint64_t seed) {
  Random random(seed);
  const auto fill = [&](auto pixel) {
    Image<decltype(pixel)> image(kSize.width, kSize.height);
    for (int y = 0; y < kSize.height; ++y) {
      for (int x = 0; x < kSize.width; ++x) image(x, y) = static_cast<decltype(pixel)>(random.below(1U << format.bits));
    }
    return FrameImage::own(std::move(image), format);
  };
  return format.bits > 8 ? fill(std::uint16_t{}) : fill(std::uint8_t{});
}

bool same_pixels(const FrameImage& a, const FrameImage& b) {
  if (a.size() != b.size() || !(a.format() == b.format())) return false;
  for (int y = 0; y < a.height(); ++y) {
    for (int x = 0; x < a.width(); ++x) {
      const bool same = a.format().bits > 8 ? a.as<std::uint16_t>()(x, y) == b.as<std::uint16_t>()(x, y)
                                            : a.as<std::uint8_t>()(x, y) == b.as<std::uint8_t>()(x, y);
      if (!same) return false;
    }
  }
  return true;
}

StereoFrame make_frame(std::int64_t id, const std::string& pair, std::int64_t stamp_ns, PixelFormat format = {}) {
  StereoFrame frame;
  frame.frame_id = id;
  frame.pair = pair;
  frame.left_stamp = frame.right_stamp = {stamp_ns};
  frame.left = noise(format, static_cast<std::uint64_t>(2 * id));
  frame.right = noise(format, static_cast<std::uint64_t>(2 * id + 1));
  return frame;
}

std::vector<Sample> all_samples(Recording& source) {
  std::vector<Sample> samples;
  while (true) {
    auto sample = source.next();
    EXPECT_TRUE(sample) << sample.error().message();
    if (!sample || !*sample) return samples;
    samples.push_back(std::move(**sample));
  }
}

double any_number() {
  return *rc::gen::map(rc::gen::inRange<std::int64_t>(-1000000000000, 1000000000000),
                       [](std::int64_t v) { return static_cast<double>(v) / 3.7e10; });
}

RC_GTEST_PROP(SpartanRecording, ReadsBackWhatWasWritten, ()) {
  const TemporaryFolder folder;
  PixelFormat format;
  format.layout = *rc::gen::element(PixelLayout::gray, PixelLayout::bayer_grbg);
  format.bits = *rc::gen::inRange(8, 17);
  if (format.bits > 8) format.alignment = *rc::gen::element(BitAlignment::low, BitAlignment::high);
  const Rig rig = rover(format);
  auto writer = RecordingWriter::create(folder.path() + "/rec", rig, {"yard \"1\"", "two: lines\nhere", 3.71});
  RC_ASSERT(static_cast<bool>(writer));

  std::vector<StereoFrame> frames;
  std::int64_t stamp = *rc::gen::inRange<std::int64_t>(0, 2000000000000000000);
  const int count = *rc::gen::inRange(1, 5);
  for (int i = 0; i < count; ++i) {
    stamp += *rc::gen::inRange<std::int64_t>(1, 3000000000);
    StereoFrame frame = make_frame(i, *rc::gen::element<std::string>("front", "mast"), stamp, format);
    frame.right_stamp.ns += *rc::gen::inRange(-4000000, 4000000);
    frame.position_id = *rc::gen::inRange(-1, 5);
    frame.pan_rad = any_number() / 10;
    frame.tilt_rad = any_number() / 10;
    frame.exposure_us = std::abs(any_number());
    frame.gain = std::abs(any_number());
    RC_ASSERT(static_cast<bool>(writer->add(frame)));
    frames.push_back(std::move(frame));
  }
  const ImuSample imu{{stamp}, {any_number(), any_number(), any_number()}, {any_number(), any_number(), any_number()}};
  const WheelSample wheels{{stamp}, any_number(), any_number()};
  const CompassSample compass{{stamp}, any_number(), std::abs(any_number())};
  const InclinometerSample inclinometer{{stamp}, any_number(), any_number(), std::abs(any_number())};
  RC_ASSERT(writer->add(imu) && writer->add(wheels) && writer->add(compass) && writer->add(inclinometer));
  RC_ASSERT(static_cast<bool>(writer->finish()));

  auto source = open_recording(folder.path() + "/rec");
  if (!source) RC_FAIL(source.error().message());
  const RecordingInfo& info = (*source)->info();
  RC_ASSERT(info.format == RecordingFormat::spartan);
  RC_ASSERT(info.rig == rig);
  RC_ASSERT(info.name == "yard \"1\"");
  RC_ASSERT(info.description == "two: lines\nhere");
  RC_ASSERT(info.gravity_m_s2 == 3.71);
  RC_ASSERT(info.has_imu);
  std::size_t next = 0, sensors = 0;
  for (const Sample& sample : all_samples(**source)) {
    if (const auto* i = std::get_if<ImuSample>(&sample)) {
      RC_ASSERT(i->stamp == imu.stamp && i->gyro_rad_s == imu.gyro_rad_s && i->accel_m_s2 == imu.accel_m_s2);
      ++sensors;
    } else if (const auto* w = std::get_if<WheelSample>(&sample)) {
      RC_ASSERT(w->stamp == wheels.stamp && w->left_m == wheels.left_m && w->right_m == wheels.right_m);
      ++sensors;
    } else if (const auto* c = std::get_if<CompassSample>(&sample)) {
      RC_ASSERT(c->heading_rad == compass.heading_rad && c->sigma_rad == compass.sigma_rad);
      ++sensors;
    } else if (const auto* n = std::get_if<InclinometerSample>(&sample)) {
      RC_ASSERT(n->roll_rad == inclinometer.roll_rad && n->pitch_rad == inclinometer.pitch_rad);
      RC_ASSERT(n->sigma_rad == inclinometer.sigma_rad);
      ++sensors;
    } else {
      const auto* read = std::get_if<StereoFrame>(&sample);
      if (!read) RC_FAIL(std::get<MissingFrame>(sample).message);
      const StereoFrame& wrote = frames.at(next++);
      RC_ASSERT(read->frame_id == wrote.frame_id && read->position_id == wrote.position_id && read->pair == wrote.pair);
      RC_ASSERT(read->left_stamp == wrote.left_stamp && read->right_stamp == wrote.right_stamp);
      RC_ASSERT(read->pan_rad == wrote.pan_rad && read->tilt_rad == wrote.tilt_rad);
      RC_ASSERT(read->exposure_us == wrote.exposure_us && read->gain == wrote.gain);
      RC_ASSERT(same_pixels(read->left, wrote.left) && same_pixels(read->right, wrote.right));
    }
  }
  RC_ASSERT(next == frames.size());
  RC_ASSERT(sensors == 4u);
}

// A small valid recording, written for each test and then damaged.
class SpartanRecordingFaults : public ::testing::Test {
 protected:
  SpartanRecordingFaults() {
    auto writer = RecordingWriter::create(path_, rover(), {"r", "", 9.81}).value();
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(writer.add(make_frame(i, "front", 2'000'000'000LL * i)));
    for (int i = 0; i < 5; ++i) EXPECT_TRUE(writer.add(ImuSample{{1'500'000'000LL * i}, {0, 0, 0}, {0, 0, 9.81}}));
    EXPECT_TRUE(writer.finish());
  }
  void change(const std::string& file, const std::string& what, const std::string& with) {
    std::string text = read_file(path_ + "/" + file).value();
    const std::size_t at = text.find(what);
    ASSERT_NE(at, std::string::npos) << file << " has no " << what;
    folder_.write("rec/" + file, text.replace(at, what.size(), with));
  }
  std::string error_message() {
    auto source = open_recording(path_);
    while (source) {
      const auto sample = (*source)->next();
      if (!sample) return sample.error().message();
      if (!*sample) return "nothing";
    }
    return source.error().message();
  }
  std::vector<FrameFault> faults() {
    std::vector<FrameFault> found;
    for (const Sample& sample : all_samples(*open_recording(path_).value())) {
      if (const auto* missing = std::get_if<MissingFrame>(&sample)) found.push_back(missing->fault);
    }
    return found;
  }
  TemporaryFolder folder_;
  const std::string path_ = folder_.path() + "/rec";
};

TEST_F(SpartanRecordingFaults, NoneInAValidRecordingAtHalfAHertz) {
  EXPECT_EQ(error_message(), "nothing");
  auto source = open_recording(path_).value();
  EXPECT_EQ(source->info().sequence.announced, 5);
  EXPECT_EQ(source->info().sequence.gaps, 0);
  EXPECT_EQ(source->info().sequence.median_step_s, 2);
  // Ordered by stamp; at equal stamps the sensor comes first.
  std::string order;
  for (const Sample& sample : all_samples(*source)) order += std::holds_alternative<ImuSample>(sample) ? 'i' : 'f';
  EXPECT_EQ(order, "ifififiiff");
}

TEST_F(SpartanRecordingFaults, ErrorsInTablesNameFileLineAndColumn) {
  change("frames.csv", "2,-1,front,4000000000", "2,-1,front,4e9");
  EXPECT_THAT(error_message(), HasSubstr("frames.csv:4: left_stamp_ns is '4e9'"));
  change("frames.csv", "4e9", "4000000000");
  change("frames.csv", "1,-1,front", "1,-1,rear");
  EXPECT_THAT(error_message(), HasSubstr("frames.csv:3: pair (not in the rig) is 'rear'"));
  change("frames.csv", "rear", "front");
  change("frames.csv", "frame_id", "id");
  EXPECT_THAT(error_message(), HasSubstr("frames.csv:1: the columns are"));
  change("frames.csv", "id", "frame_id");
}

TEST_F(SpartanRecordingFaults, TablesOfOtherProgramsAreRecognised) {
  for (const char* table : {"#timestamp [ns],filename\n1403715273262142976,1403715273262142976.png\n",
                            "1403715273262142976,1403715273262142976.png\n"}) {
    folder_.write("rec/frames.csv", table);
    EXPECT_THAT(error_message(), HasSubstr("give the folder that holds mav0")) << table;
  }
  folder_.write("rec/frames.csv", "%time,field.header.seq,field.header.stamp\n1,2,3\n");
  EXPECT_THAT(error_message(), HasSubstr("spartan-bag import"));
  folder_.write("rec/frames.csv", "number,pair\n1,front\n");
  EXPECT_THAT(error_message(), Not(HasSubstr("mav0")));
}

TEST_F(SpartanRecordingFaults, ErrorsInYamlFilesNameTheFile) {
  change("recording.yaml", "name:", "nam:");
  EXPECT_THAT(error_message(), HasSubstr("recording.yaml"));
  change("recording.yaml", "nam:", "name:");
  change("rig.yaml", "bits: 8", "bits: 99");
  EXPECT_THAT(error_message(), HasSubstr("rig.yaml"));
  std::filesystem::remove(path_ + "/recording.yaml");
  EXPECT_THAT(error_message(), HasSubstr("the recording was not finished"));
  change("rig.yaml", "bits: 99", "bits: 8");
  OpenOptions options;
  options.unfinished = true;
  EXPECT_TRUE(open_recording(path_, options));
}

TEST_F(SpartanRecordingFaults, ATruncatedRowIsLeftOut) {
  std::string text = read_file(path_ + "/sensors/imu.csv").value();
  text.resize(text.size() - 2);
  folder_.write("rec/sensors/imu.csv", text);
  const auto source = open_recording(path_);
  ASSERT_TRUE(source);
  EXPECT_EQ(all_samples(**source).size(), 9U);
  EXPECT_EQ((*source)->discarded().unreadable, 1);
  EXPECT_THAT((*source)->discarded().first_unreadable, HasSubstr("imu.csv:6: the file is truncated"));
}

TEST_F(SpartanRecordingFaults, SkipsMissingAndDamagedImages) {
  std::filesystem::remove(path_ + "/images/front/2000000000_right.png");
  folder_.write("rec/images/front/4000000000_left.png", "no image");
  const std::string whole = read_file(path_ + "/images/front/6000000000_left.png").value();
  folder_.write("rec/images/front/6000000000_left.png", whole.substr(0, whole.size() / 2));
  ASSERT_TRUE(write_png(path_ + "/images/front/8000000000_right.png", Image<std::uint8_t>(25, 16).view()));
  EXPECT_EQ(faults(), (std::vector<FrameFault>{FrameFault::right_missing, FrameFault::unreadable,
                                               FrameFault::unreadable, FrameFault::wrong_size}));
}

TEST_F(SpartanRecordingFaults, DeliversTheImageThatIsThere) {
  std::filesystem::remove(path_ + "/images/front/2000000000_right.png");
  folder_.write("rec/images/front/4000000000_left.png", "no image");
  std::filesystem::remove(path_ + "/images/front/6000000000_left.png");
  std::filesystem::remove(path_ + "/images/front/6000000000_right.png");
  change("frames.csv", "4,-1,front,8000000000,8000000000", "4,-1,front,8000000000,8100000000");
  std::string found;
  for (const Sample& sample : all_samples(*open_recording(path_).value())) {
    const auto* missing = std::get_if<MissingFrame>(&sample);
    if (missing == nullptr) continue;
    found += std::to_string(missing->frame_id) + ":";
    if (!missing->partial) continue;
    EXPECT_EQ(missing->partial->frame_id, missing->frame_id);
    EXPECT_EQ(missing->partial->left_stamp, missing->stamp);
    if (!missing->partial->left.empty()) found += "left";
    if (!missing->partial->right.empty()) found += "right";
  }
  EXPECT_EQ(found, "1:left2:right3:4:");
}

TEST_F(SpartanRecordingFaults, DetectsReversedAndUnsynchronizedStamps) {
  change("frames.csv", "2,-1,front,4000000000,4000000000", "2,-1,front,1000000000,1000000000");
  change("frames.csv", "3,-1,front,6000000000,6000000000", "3,-1,front,6000000000,6100000000");
  EXPECT_EQ(faults(), (std::vector<FrameFault>{FrameFault::stamp_reversed, FrameFault::stamps_apart}));
  EXPECT_EQ(open_recording(path_).value()->info().sequence.reversals, 1);
}

TEST_F(SpartanRecordingFaults, SeekContinuesLikeAnUninterruptedReader) {
  std::filesystem::remove(path_ + "/images/front/4000000000_left.png");
  const auto all = all_samples(*open_recording(path_).value());
  for (std::size_t taken = 0; taken <= all.size(); ++taken) {
    auto source = open_recording(path_).value();
    ASSERT_TRUE(source->seek(static_cast<std::int64_t>(taken)));
    const auto rest = all_samples(*source);
    ASSERT_EQ(rest.size(), all.size() - taken);
    for (std::size_t i = 0; i < rest.size(); ++i) {
      EXPECT_EQ(rest[i].index(), all[taken + i].index());
      EXPECT_EQ(stamp_of(rest[i]), stamp_of(all[taken + i]));
    }
  }
  EXPECT_FALSE(open_recording(path_).value()->seek(static_cast<std::int64_t>(all.size()) + 1));
}

TEST_F(SpartanRecordingFaults, ASampleOnRequestHasTheImageThatIsThere) {
  std::filesystem::remove(path_ + "/images/front/6000000000_right.png");
  auto source = open_recording(path_).value();
  const auto sample = source->sample_at("front", {6'000'000'000LL});
  ASSERT_TRUE(sample) << sample.error().message();
  const auto* const missing = std::get_if<MissingFrame>(&*sample);
  ASSERT_NE(missing, nullptr);
  EXPECT_EQ(missing->fault, FrameFault::right_missing);
  ASSERT_TRUE(missing->partial);
  EXPECT_FALSE(missing->partial->left.empty());
  EXPECT_EQ(source->frame_at("front", {6'000'000'000LL}).error().code, ErrorCode::input);
}

TEST_F(SpartanRecordingFaults, FramesOnRequestByStamp) {
  auto source = open_recording(path_).value();
  EXPECT_EQ(source->listed_stamps("front").size(), 5u);
  const auto frame = source->frame_at("front", {6'000'000'000LL});
  ASSERT_TRUE(frame) << frame.error().message();
  EXPECT_EQ(frame->frame_id, 3);
  EXPECT_TRUE(same_pixels(frame->left, make_frame(3, "front", 0).left));
  EXPECT_THAT(source->frame_at("front", {7}).error().message(),
              HasSubstr("has no frame of pair 'front' at 0.000000007 s"));
  EXPECT_FALSE(source->frame_at("mast", {6'000'000'000LL}));
  const auto imu = source->imu_samples({}, 3);
  ASSERT_TRUE(imu);
  EXPECT_EQ(imu->size(), 3u);
  const Stamp second = (*imu)[1].stamp;
  const auto later = source->imu_samples(second, 1.5);
  ASSERT_TRUE(later);
  ASSERT_FALSE(later->empty());
  EXPECT_EQ(later->front().stamp, second);
}

TEST_F(SpartanRecordingFaults, FramesOfAStop) {
  change("frames.csv", "2,-1,front", "2,7,front");
  change("frames.csv", "3,-1,front", "3,7,front");
  std::filesystem::remove(path_ + "/images/front/4000000000_left.png");
  const auto source = open_recording(path_).value();
  const auto keys = source->frames_at(7);
  ASSERT_EQ(keys.size(), 1u) << "the other frame has no left image";
  EXPECT_EQ(keys[0].pair, "front");
  EXPECT_EQ(keys[0].left_stamp.ns, 6000000000);
  EXPECT_TRUE(source->frames_at(8).empty());
}

TEST(RecordingWriter, DoesNotOverwriteAFolder) {
  const TemporaryFolder folder;
  folder.write("mine.txt", "keep");
  const auto rejected = RecordingWriter::create(folder.path(), rover(), {});
  ASSERT_FALSE(rejected);
  EXPECT_EQ(rejected.error().code, ErrorCode::output);
  EXPECT_THAT(rejected.error().message(), HasSubstr("already exists"));
  Rig faulty = rover();
  faulty.pairs.clear();
  EXPECT_EQ(RecordingWriter::create(folder.path() + "/new", faulty, {}).error().code, ErrorCode::configuration);
  EXPECT_EQ(RecordingWriter::create("/proc/no/where", rover(), {}).error().code, ErrorCode::output);
}

TEST(RecordingWriter, RejectsFramesOfAnUnknownPair) {
  const TemporaryFolder folder;
  auto writer = RecordingWriter::create(folder.path() + "/rec", rover(), {}).value();
  EXPECT_FALSE(writer.add(make_frame(0, "rear", 1)));
  EXPECT_TRUE(writer.add(make_frame(0, "front", 1)));
  EXPECT_THAT(open_recording(folder.path() + "/rec").error().message(), HasSubstr("was not finished"));
}

TEST(RecordingWriter, WritesGroundTruthInTheDocumentedFormat) {
  const TemporaryFolder folder;
  auto writer = RecordingWriter::create(folder.path() + "/rec", rover(), {}).value();
  ASSERT_TRUE(writer.add(make_frame(0, "front", 1)));
  Image<float> disparity(3, 1, std::numeric_limits<float>::quiet_NaN());
  disparity(0, 0) = 2.5f;
  disparity(1, 0) = 300.0f;  // above the largest value of the format
  Image<std::uint8_t> mask(3, 1, std::uint8_t{128});
  ASSERT_TRUE(writer.write_truth_disparity("front", {1}, disparity, mask));
  ASSERT_TRUE(writer.write_truth(rover(), {{Stamp{1}, Pose::from_translation({1, 2, 3})}}));
  ASSERT_TRUE(writer.finish());
  const std::string truth = folder.path() + "/rec/truth";
  const auto fixed = read_image(truth + "/disparity/front/1.png").value();
  EXPECT_EQ(fixed.as<std::uint16_t>()(0, 0), 640);
  EXPECT_EQ(fixed.as<std::uint16_t>()(1, 0), 65535);
  EXPECT_EQ(fixed.as<std::uint16_t>()(2, 0), 0);
  EXPECT_EQ(read_image(truth + "/mask/front/1.png").value().as<std::uint8_t>()(0, 0), 128);
  EXPECT_TRUE(read_rig_yaml(truth + "/rig.yaml"));
  EXPECT_EQ(open_recording(folder.path() + "/rec").value()->info().truth_file, truth + "/poses.tum");
}

// The example tables of docs/reference/recording.md, written to a folder unchanged.
TEST(SpartanRecording, ReadsTheExamplesOfTheDocumentation) {
  const TemporaryFolder folder;
  for (const char* name : {"recording.yaml", "frames.csv"})
    folder.write(std::string("rec/") + name, testing::doc_example(name));
  for (const char* name : {"imu.csv", "wheels.csv", "compass.csv", "inclinometer.csv"}) {
    ASSERT_FALSE(testing::doc_example(name).empty()) << name;
    folder.write(std::string("rec/sensors/") + name, testing::doc_example(name));
  }
  folder.write("rec/rig.yaml", to_rig_yaml(rover()));
  for (const char* name : {"front/1000000000", "mast/1000000000", "front/2500000000"}) {
    for (const char* side : {"_left.png", "_right.png"}) {
      const std::string path = folder.file(std::string("rec/images/") + name + side);
      ASSERT_TRUE(write_png(path, Image<std::uint8_t>(kSize.width, kSize.height).view()));
    }
  }
  auto source = open_recording(folder.path() + "/rec");
  ASSERT_TRUE(source) << source.error().message();
  EXPECT_EQ((*source)->info().name, "yard");
  std::vector<StereoFrame> frames;
  int imu = 0, wheels = 0, compass = 0, inclinometer = 0;
  for (const Sample& sample : all_samples(**source)) {
    if (const auto* frame = std::get_if<StereoFrame>(&sample)) frames.push_back(*frame);
    imu += std::holds_alternative<ImuSample>(sample);
    wheels += std::holds_alternative<WheelSample>(sample);
    compass += std::holds_alternative<CompassSample>(sample);
    inclinometer += std::holds_alternative<InclinometerSample>(sample);
  }
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[1].pair, "mast");
  EXPECT_NEAR(frames[1].pan_rad, -35 * 3.14159265358979 / 180, 1e-12);
  EXPECT_EQ(frames[2].position_id, -1);
  EXPECT_EQ(imu, 2);
  EXPECT_EQ(wheels, 2);
  EXPECT_EQ(compass, 1);
  EXPECT_EQ(inclinometer, 1);
}

}  // namespace
}  // namespace spartan
