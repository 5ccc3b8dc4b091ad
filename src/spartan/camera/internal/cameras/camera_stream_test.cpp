#include "spartan/camera/internal/cameras/camera_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <optional>
#include <thread>

#include "spartan/camera/internal/cameras/scripted_camera_test.h"
#include "spartan/testing/temporary_folder.h"
#include "spartan/testing/text_checks.h"

namespace spartan::internal {
namespace {

using std::chrono::milliseconds;
using ::testing::Contains;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

// A pair for panoramas, on a mast.
Rig with_a_second_pair(Rig rig) {
  const Rig other = two_cameras();
  for (Camera camera : other.cameras) {
    camera.name = "mast_" + camera.name;
    camera.driver->source = "test:" + camera.name;
    rig.cameras.push_back(camera);
  }
  rig.pairs.push_back({"mast", "mast_left", "mast_right", 0, false});
  return rig;
}

TEST_F(CameraStreamTest, AStreamBeginsWithoutPairsThatTheOdometryDoesNotUse) {
  first_wait = std::chrono::seconds(2);
  scripts["mast_right"].openable = false;
  {
    const auto stream = open_while_delivering(with_a_second_pair(two_cameras()));
    ASSERT_TRUE(stream) << stream.error().message();
    EXPECT_EQ((*stream)->previews("front"), 1u);
    EXPECT_EQ((*stream)->previews("mast"), 0u);
    const auto said = take_said();
    EXPECT_THAT(said, Contains(HasSubstr("mast_right: is not there; trying again")).Times(1));
    EXPECT_THAT(said, Contains(HasSubstr("pair mast delivers no frame")).Times(1));
    scripts["mast_right"].openable = true;
    while (scripts["mast_right"].opened == 0) std::this_thread::sleep_for(milliseconds(5));
    for (const char* camera : {"mast_left", "mast_right"}) scripts[camera].add(image_read(1, 3));
    while (source_of(next(**stream)) != "mast") continue;
    EXPECT_TRUE((*stream)->set_exposure("mast", {2000, 1}));
  }
  take_said();
  scripts["mast_right"].openable = true;  // but it delivers nothing
  {
    const auto stream = open_while_delivering(with_a_second_pair(two_cameras()));
    ASSERT_TRUE(stream) << stream.error().message();
    const auto said = take_said();
    ASSERT_EQ(said.size(), 1u);
    EXPECT_THAT(said[0], HasSubstr("pair mast delivers no frame"));
  }
  scripts["right"].openable = false;
  EXPECT_FALSE(open(with_a_second_pair(two_cameras()))) << "the pair of the odometry";
}

TEST_F(CameraStreamTest, WaitingForTheFirstFramesCanBeInterrupted) {
  first_wait = std::chrono::seconds(100);
  std::atomic<int> asked = 0;
  should_stop = [&] { return ++asked > 2; };
  const auto stream = open(two_cameras());
  ASSERT_FALSE(stream);
  EXPECT_EQ(stream.error().code, ErrorCode::interrupted);
}

TEST_F(CameraStreamTest, TheErrorWithoutAFirstFrameSaysWhyImagesWereNotTaken) {
  left_script.add(image_read(1, 1, {4, 3}));
  right_script.add(image_read(1, 1, {4, 3}));
  const auto stream = open(two_cameras());
  ASSERT_FALSE(stream);
  EXPECT_EQ(stream.error().code, ErrorCode::read_error);
  EXPECT_THAT(stream.error().what, HasSubstr("delivers images of 4 × 3, the rig has 8 × 6"));
  EXPECT_THAT(stream.error().hint, HasSubstr("size_px"));
}

TEST_F(CameraStreamTest, PairsOfImagesBecomeFrames) {
  deliver(1);
  auto stream = open(two_cameras());
  ASSERT_TRUE(stream) << stream.error().message();
  EXPECT_EQ((*stream)->previews("front"), 1u);
  EXPECT_EQ((*stream)->preview("front", 0)->left.as<std::uint8_t>()(0, 0), 1);
  EXPECT_EQ((*stream)->preview("front", 0)->right.as<std::uint8_t>()(0, 0), 2);
  EXPECT_FALSE((*stream)->preview("front", 1));
  EXPECT_EQ((*stream)->read(milliseconds(1))->state, StreamRead::State::none_yet);
  std::optional<Stamp> before;
  for (int i = 2; i < 12; ++i) {
    deliver(i);
    std::this_thread::sleep_for(milliseconds(2));
    const Sample sample = next(**stream);
    const auto& frame = std::get<StereoFrame>(sample);
    EXPECT_EQ(frame.pair, "front");
    if (before) {
      EXPECT_GT(frame.left_stamp, *before);
    }
    before = frame.left_stamp;
  }
  const auto reports = (*stream)->camera_reports();
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_EQ(reports[0].pairs, 10);
  EXPECT_EQ(reports[0].left_alone + reports[0].right_alone + reports[0].incomplete, 0);
  EXPECT_EQ(reports[0].cameras[0].camera, "left");
  EXPECT_EQ(reports[0].cameras[1].images, 11) << "the preview is one of them";
  scripts["left"].add({DeviceRead::State::end, {}, {}});
  scripts["right"].add({DeviceRead::State::end, {}, {}});
  EXPECT_EQ((*stream)->read(std::chrono::seconds(20))->state, StreamRead::State::end);
}

TEST_F(CameraStreamTest, WhatCannotBeDeliveredIsNamedAndCounted) {
  deliver(1);
  auto stream = open(two_cameras());
  ASSERT_TRUE(stream) << stream.error().message();
  static_cast<void>((*stream)->read(milliseconds(1)));
  scripts["left"].add(image_read(2, 1));
  const Sample alone = next(**stream);
  EXPECT_EQ(std::get<MissingFrame>(alone).fault, FrameFault::right_missing);
  EXPECT_THAT(std::get<MissingFrame>(alone).message, HasSubstr("camera right"));
  EXPECT_FALSE(std::get<MissingFrame>(alone).partial->left.empty());

  DeviceRead torn = image_read(3, 1);
  torn.image.image = {};
  scripts["left"].add(torn);
  scripts["right"].add(image_read(3, 2));
  const Sample incomplete = next(**stream);
  EXPECT_EQ(std::get<MissingFrame>(incomplete).fault, FrameFault::left_missing);
  EXPECT_THAT(std::get<MissingFrame>(incomplete).message, HasSubstr("not complete"));

  scripts["left"].add(image_read(4, 1, {4, 4}));
  scripts["right"].add(image_read(4, 2));
  EXPECT_EQ(std::get<MissingFrame>(next(**stream)).fault, FrameFault::wrong_size);

  deliver(5);
  EXPECT_TRUE(std::holds_alternative<StereoFrame>(next(**stream)));
  // Again, one of before, and one after two that were left out.
  scripts["left"].add(image_read(5, 1));
  scripts["left"].add(image_read(4, 1));
  deliver(8);
  EXPECT_TRUE(std::holds_alternative<StereoFrame>(next(**stream)));
  const CameraPairReport report = (*stream)->camera_reports()[0];
  EXPECT_EQ(report.pairs, 2);
  EXPECT_EQ(report.left_alone, 1);
  EXPECT_EQ(report.incomplete, 1);
  EXPECT_EQ(report.wrong_size, 1);
  EXPECT_EQ(report.cameras[0].duplicates, 1);
  EXPECT_EQ(report.cameras[0].reversed, 1);
  EXPECT_EQ(report.cameras[0].not_received, 2);
  EXPECT_EQ(report.cameras[0].incomplete, 1);
  EXPECT_EQ(report.cameras[1].not_received, 3) << "the one without a partner, and two";
  EXPECT_THAT(describe(report), HasSubstr("1 left images alone"));
}

TEST_F(CameraStreamTest, CanBeClosedWhileImagesArrive) {
  for (int round = 0; round < 100; ++round) {
    for (int i = 0; i < 2000; ++i) deliver(i);
    auto stream = open(two_cameras());
    ASSERT_TRUE(stream) << stream.error().message();
    stream->reset();
    for (const char* name : {"left", "right"}) {
      const std::lock_guard lock(scripts[name].mutex);
      ASSERT_FALSE(scripts[name].reads.empty()) << "all images have arrived before";
      scripts[name].reads = {};
    }
  }
}

TEST_F(CameraStreamTest, TheBoundsOfAPairAreThoseOfBothCameras) {
  scripts["left"].bounds = {10, 1e6, 1, 1};
  scripts["right"].bounds = {20, 1e5, 1.2, 8};
  deliver(1);
  auto stream = open(two_cameras());
  ASSERT_TRUE(stream) << stream.error().message();
  const ExposureBounds bounds = (*stream)->exposure_bounds("front");
  EXPECT_EQ(bounds.shortest_us, 20);
  EXPECT_EQ(bounds.longest_us, 1e5);
  EXPECT_EQ(bounds.smallest_gain, 1.2) << "no gain suits both: that of the right camera";
  EXPECT_EQ(bounds.largest_gain, 1.2);
  EXPECT_EQ((*stream)->exposure_bounds("other").shortest_us, 0);
}

TEST_F(CameraStreamTest, ACameraThatIsLostIsOpenedAgainWithItsExposure) {
  deliver(1);
  auto stream = open(two_cameras());
  ASSERT_TRUE(stream) << stream.error().message();
  ASSERT_TRUE((*stream)->set_exposure("front", {2000, 1.5}));
  while (scripts["left"].exposures < 1 || scripts["right"].exposures < 1) std::this_thread::sleep_for(milliseconds(1));
  static_cast<void>((*stream)->read(milliseconds(1)));
  scripts["right"].openable = false;
  scripts["right"].add({DeviceRead::State::lost, {}, "unplugged"});
  while (scripts["right"].opened == 1 && (*stream)->camera_reports()[0].cameras[1].losses == 0) {
    std::this_thread::sleep_for(milliseconds(1));
  }
  scripts["left"].add(image_read(2, 1));
  const Sample alone = next(**stream);
  EXPECT_THAT(std::get<MissingFrame>(alone).message, HasSubstr("camera right does not answer"));
  EXPECT_FALSE((*stream)->trigger("front")) << "one of them does not answer";

  scripts["right"].openable = true;
  while (scripts["right"].opened < 2) std::this_thread::sleep_for(milliseconds(1));
  deliver(3);
  EXPECT_TRUE(std::holds_alternative<StereoFrame>(next(**stream)));
  while (scripts["right"].exposures < 2) std::this_thread::sleep_for(milliseconds(1));
  EXPECT_EQ(scripts["left"].exposures, 1) << "the other one is not set again";
  EXPECT_EQ((*stream)->camera_reports()[0].cameras[1].losses, 1);
}

// The first images arrive late, as beside a program that starts.
TEST_F(CameraStreamTest, StampsIncreaseWhereImagesArriveEarlierThanBefore) {
  const auto start = Clock::now();
  const auto add = [&](int id, int late_ms) {
    for (const char* name : {"left", "right"}) {
      DeviceRead read = image_read(id, 1);
      read.image.camera_ns = id * 100'000'000LL;
      read.image.began = start + milliseconds(100 * id + late_ms);
      scripts[name].add(read);
    }
  };
  add(1, 150);
  auto stream = open(two_cameras());
  ASSERT_TRUE(stream) << stream.error().message();
  static_cast<void>((*stream)->read(milliseconds(1)));
  std::optional<Stamp> before;
  const int late_ms[] = {150, 100, 20, 0, 0};
  for (int i = 0; i < 5; ++i) {
    add(i + 2, late_ms[i]);
    const Sample sample = next(**stream);
    ASSERT_TRUE(std::holds_alternative<StereoFrame>(sample)) << i;
    const Stamp stamp = std::get<StereoFrame>(sample).left_stamp;
    if (before) {
      EXPECT_GE(seconds_between(*before, stamp), 0.0499) << i;
    }
    before = stamp;
  }
}

TEST_F(CameraStreamTest, ASilentCameraIsNotWaitedForUntilItDeliversAgain) {
  deliver(1);
  auto stream = open(two_cameras());
  ASSERT_TRUE(stream) << stream.error().message();
  static_cast<void>((*stream)->read(milliseconds(1)));
  const auto alone_after = [&](int id) {
    const auto begin = Clock::now();
    scripts["left"].add(image_read(id, 1));
    EXPECT_TRUE(std::holds_alternative<MissingFrame>(next(**stream)));
    return Clock::now() - begin;
  };
  for (int id = 2; id < 5; ++id) EXPECT_GE(alone_after(id), milliseconds(95)) << "the other one may come";
  std::this_thread::sleep_for(milliseconds(1000));
  // The shortest of several, for a machine that is busy.
  auto shortest = alone_after(5);
  for (int id = 6; id < 16; ++id) shortest = std::min(shortest, alone_after(id));
  EXPECT_LT(shortest, milliseconds(95));
  scripts["right"].add(image_read(16, 2));
  EXPECT_EQ(std::get<MissingFrame>(next(**stream)).fault, FrameFault::left_missing);
  deliver(17);
  EXPECT_TRUE(std::holds_alternative<StereoFrame>(next(**stream)));
}

// A pair that is triggered every 1.5 s, of which the right camera was away for some images.
TEST_F(CameraStreamTest, SlowCamerasArePairedAgain) {
  pair_wait = std::chrono::seconds(20);
  const auto start = Clock::now() - std::chrono::seconds(60);
  const auto add = [&](const char* name, int id, Clock::time_point time, bool waits = false) {
    DeviceRead read = image_read(id, 1);
    read.image.began = time;
    if (!waits) read.image.complete = time;
    read.image.camera_ns = time.time_since_epoch() / std::chrono::nanoseconds(1);
    scripts[name].add(read);
  };
  const auto time_of = [&](int id) { return start + milliseconds(1500) * id; };
  add("left", 1, time_of(1), true);
  add("right", 1, time_of(1), true);
  auto stream = open(two_cameras());
  ASSERT_TRUE(stream) << stream.error().message();
  static_cast<void>((*stream)->read(milliseconds(1)));
  for (int id = 2; id < 7; ++id) {
    add("left", id, time_of(id));
    EXPECT_EQ(std::get<MissingFrame>(next(**stream)).fault, FrameFault::right_missing);
  }
  add("right", 7, time_of(7));
  EXPECT_EQ(std::get<MissingFrame>(next(**stream)).fault, FrameFault::left_missing);
  const auto now = Clock::now();
  add("left", 8, now);
  EXPECT_EQ((*stream)->read(milliseconds(50))->state, StreamRead::State::none_yet) << "the right one will come";
  add("right", 8, now);
  EXPECT_TRUE(std::holds_alternative<StereoFrame>(next(**stream)));
}

TEST_F(CameraStreamTest, TriggersAtARateAndAccountsForEach) {
  const Rig rig = two_cameras(CameraDriver::kSoftware, 50);
  deliver(1);
  auto stream = open(rig);
  ASSERT_TRUE(stream) << stream.error().message();
  while (scripts["left"].triggers < 5 || scripts["right"].triggers < 5) {
    static_cast<void>((*stream)->read(milliseconds(5)));
  }
  EXPECT_TRUE((*stream)->trigger("front"));
  EXPECT_EQ((*stream)->trigger("back").error().code, ErrorCode::configuration);
  // None of them is answered, which is known a second later.
  while ((*stream)->camera_reports()[0].cameras[0].unanswered == 0) static_cast<void>((*stream)->read(milliseconds(5)));
  EXPECT_GE((*stream)->camera_reports()[0].cameras[0].triggers, 6);
}

TEST_F(CameraStreamTest, OpeningFailsWithTheReason) {
  scripts["left"].add(image_read(1, 1));
  const auto half = open(two_cameras());
  ASSERT_FALSE(half);
  EXPECT_EQ(half.error().code, ErrorCode::read_error);
  EXPECT_THAT(half.error().message(), HasSubstr("1 images by left, 0 by right"));

  scripts["right"].openable = false;
  EXPECT_THAT(open(two_cameras()).error().message(), HasSubstr("is not there"));

  Rig rig = two_cameras();
  rig.cameras[1].driver.reset();
  EXPECT_THAT(testing::error_message(open(rig)), HasSubstr("cameras.right: has no driver"));
  rig.cameras[0].driver.reset();
  EXPECT_EQ(open(rig).error().code, ErrorCode::configuration);
}

}  // namespace
}  // namespace spartan::internal
