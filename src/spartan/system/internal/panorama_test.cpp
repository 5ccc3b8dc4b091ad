#include "spartan/system/internal/panorama.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <mutex>
#include <string>
#include <thread>

namespace spartan::internal {
namespace {

using namespace std::chrono_literals;

// Is at once where it is sent.
class QuickUnit : public PanTiltControl {
 public:
  Status move_to(const PanTiltAngles& angles) override {
    const std::lock_guard lock(mutex_);
    angles_ = angles;
    return {};
  }
  Result<PanTiltReading> read() override {
    const std::lock_guard lock(mutex_);
    return PanTiltReading{angles_, false};
  }
  double sigma_rad() const override { return 0; }

 private:
  std::mutex mutex_;
  PanTiltAngles angles_;
};

// Both pairs are on the unit, which rests at 0.1 and 0.6 rad.
Rig rig_with_all_on_the_unit() {
  Rig rig;
  PanTiltUnit mast;
  mast.name = "mast";
  mast.rest_pan_rad = 0.1;
  mast.rest_tilt_rad = 0.6;
  rig.pan_tilt_units = {mast};
  for (const char* name : {"a", "b", "c", "d"}) {
    Camera camera;
    camera.name = name;
    camera.mount = "mast";
    rig.cameras.push_back(camera);
  }
  rig.pairs = {{"narrow", "a", "b", 0, true}, {"wide", "c", "d", 0, false}};
  return rig;
}

StereoFrame frame_at_stop(const std::string& pair, double seconds) {
  StereoFrame frame;
  frame.pair = pair;
  frame.left_stamp = frame.right_stamp = Stamp::from_seconds(seconds);
  return frame;
}

TEST(Panorama, TheOdometryOnTheUnitHasFramesBetweenPanoramas) {
  QuickUnit unit;
  std::atomic<int> begun = 0, ended = 0;
  RunHooks hooks;
  hooks.panorama = [&](const PanoramaEvent& event) { ++(event.begins ? begun : ended); };
  PanoramaOptions options;
  options.settle_s = 0;
  options.pans_deg = {-20, 20};
  const auto panorama = Panorama::create(rig_with_all_on_the_unit(), "narrow", options, unit, nullptr, hooks).value();
  StereoFrame before = frame_at_stop("narrow", 0);
  EXPECT_TRUE(panorama->label(before));
  EXPECT_DOUBLE_EQ(before.pan_rad, 0.1);
  EXPECT_DOUBLE_EQ(before.tilt_rad, 0.6);
  panorama->request();
  for (int i = 0; i < 20; ++i) panorama->add(RoverMotion{Stamp::from_seconds(0.1 * i), 0, Vector6d::Zero()});
  const auto until = std::chrono::steady_clock::now() + 20s;
  int views = 0, during = 0;
  for (double time_s = 2; ended == 0 && std::chrono::steady_clock::now() < until; time_s += 0.001) {
    StereoFrame wide = frame_at_stop("wide", time_s), narrow = frame_at_stop("narrow", time_s);
    views += panorama->label(wide) ? 1 : 0;
    during += begun > ended && panorama->label(narrow) && narrow.position_id >= 0 ? 1 : 0;
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(views, 2);
  EXPECT_EQ(during, 0) << "frames of a camera that turns, as if it did not";
  StereoFrame after = frame_at_stop("narrow", 100);
  EXPECT_TRUE(panorama->label(after));
  EXPECT_DOUBLE_EQ(after.pan_rad, 0.1);
}

TEST(Panorama, NeedsAPairBesidesTheOdometrys) {
  QuickUnit unit;
  Rig rig = rig_with_all_on_the_unit();
  rig.pairs.pop_back();
  const auto panorama = Panorama::create(rig, "narrow", {}, unit, nullptr, {});
  ASSERT_FALSE(panorama);
  EXPECT_EQ(panorama.error().code, ErrorCode::configuration);
}

}  // namespace
}  // namespace spartan::internal
