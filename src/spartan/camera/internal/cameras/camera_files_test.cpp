#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <variant>

#include "spartan/camera/internal/cameras/camera_stream.h"
#include "spartan/camera/internal/cameras/scripted_camera_test.h"

namespace spartan::internal {
namespace {

using std::chrono::milliseconds;

// Files, whose images are not lost where they are not read in time.
class CameraFiles : public CameraStreamTest {
 protected:
  static constexpr auto kEnd = DeviceRead::State::end;

  CameraFiles() { left_script.waits = right_script.waits = true; }
  // As one that was complete long before there was room for it.
  static void add_old(Script& script, std::int64_t id, int side = 0) {
    DeviceRead read = image_read(id, 1);
    read.image.side = side;
    read.image.camera_ns = id * 10'000'000;
    read.image.began = read.image.complete = start() + milliseconds(10 * id);
    script.add(read);
  }
  // Both images come from one file.
  static Rig one_device() {
    Rig rig = two_cameras();
    rig.cameras[1].driver->source = rig.cameras[0].driver->source;
    return rig;
  }
  void expect_pairs(CameraStream& stream, int pairs) {
    for (int i = 0; i < pairs; ++i) ASSERT_TRUE(std::holds_alternative<StereoFrame>(next(stream))) << i;
  }

 private:
  static std::chrono::steady_clock::time_point start() {
    static const auto time = std::chrono::steady_clock::now() - std::chrono::seconds(30);
    return time;
  }
};

TEST_F(CameraFiles, AnImageWaitsForItsPartnerHoweverOldItIs) {
  add_old(left_script, 1);
  add_old(right_script, 1);
  auto stream = open(two_cameras());
  ASSERT_TRUE(stream) << stream.error().message();
  expect_pairs(**stream, 1);
  add_old(left_script, 2);
  add_old(left_script, 3);
  left_script.add({kEnd, {}, {}});
  EXPECT_EQ((*stream)->read(milliseconds(300))->state, StreamRead::State::none_yet);
  add_old(right_script, 2);
  expect_pairs(**stream, 1);
  right_script.add({kEnd, {}, {}});
  const Sample alone = next(**stream);
  ASSERT_TRUE(std::holds_alternative<MissingFrame>(alone)) << "its partner can no longer come";
  EXPECT_EQ(std::get<MissingFrame>(alone).fault, FrameFault::right_missing);
  EXPECT_EQ((*stream)->read(std::chrono::seconds(20))->state, StreamRead::State::end);
}

TEST_F(CameraFiles, OneFileMayDeliverManyImagesOfOneCameraFirst) {
  constexpr int kFirst = 40;
  static_assert(kFirst > CameraStream::kMostWaiting && kFirst < CameraStream::kMostAhead);
  for (const int side : {0, 1}) {
    for (int id = 1; id <= kFirst; ++id) add_old(left_script, id, side);
  }
  auto stream = open(one_device());
  ASSERT_TRUE(stream) << stream.error().message();
  expect_pairs(**stream, kFirst);
  for (int id = kFirst; id < kFirst + 100; ++id) add_old(left_script, id + 1);
  const Sample alone = next(**stream);
  ASSERT_TRUE(std::holds_alternative<MissingFrame>(alone)) << "the right image does not come";
  EXPECT_EQ(std::get<MissingFrame>(alone).fault, FrameFault::right_missing);
}

}  // namespace
}  // namespace spartan::internal
