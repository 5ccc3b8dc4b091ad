#include "spartan/system/internal/exposure_lag.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "spartan/system/internal/exposure_stage.h"

namespace spartan::internal {
namespace {

constexpr double kLevel = 0.3;
constexpr double kLight = kLevel / 2000;  // 2 ms give the level

// A camera of 64 x 64 px that sees ground alone.
Rig rig_above_ground() {
  Rig rig;
  for (const char* name : {"left", "right"}) {
    Camera camera;
    camera.name = name;
    camera.size = {64, 64};
    camera.model = PinholeModel{64, 64, 31.5, 31.5};
    rig.cameras.push_back(camera);
  }
  rig.pairs = {{"pair", "left", "right", 2, true}};
  return rig;
}

class LastSettings : public CameraControl {
 public:
  Status set_exposure(const std::string&, const ExposureSettings& settings) override {
    last = settings;
    return {};
  }
  Status trigger(const std::string&) override { return {}; }
  ExposureSettings last;
};

StereoFrame gray_frame(double brightness) {
  Image<std::uint8_t> image(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x)
      image(x, y) = static_cast<std::uint8_t>(std::clamp(std::lround(255 * brightness), 0L, 255L));
  }
  StereoFrame frame;
  frame.pair = "pair";
  frame.left = frame.right = FrameImage::own(std::move(image), PixelFormat());
  return frame;
}

// The brightness, relative to the level, of frames that state what was set `delay` frames before, and were taken with
// what was set `late` frames before that.
std::vector<double> brightness_of(const std::vector<double>& lights, std::size_t delay, std::size_t late,
                                  double first_us) {
  LastSettings cameras;
  cameras.last = {first_us, 1};
  auto stage = ExposureStage::create(rig_above_ground(), ExposureOptions(), "", cameras, Log()).value();
  std::vector<ExposureSettings> set(delay + late, cameras.last);
  std::vector<double> relative;
  for (const double light : lights) {
    set.push_back(cameras.last);
    const ExposureSettings stated = set[set.size() - 1 - delay], taken = set[set.size() - 1 - delay - late];
    const double brightness = light * taken.exposure_us * taken.gain;
    StereoFrame frame = gray_frame(brightness);
    frame.exposure_us = stated.exposure_us;
    frame.gain = stated.gain;
    stage.update(frame, Eigen::Vector3d::UnitZ(), Vector6d::Zero());
    relative.push_back(brightness / kLevel);
  }
  return relative;
}

std::vector<double> with_step(double factor) {
  std::vector<double> lights(60, kLight);
  lights.insert(lights.end(), 60, kLight * factor);
  return lights;
}

TEST(ExposureLag, SettingsThatAreStatedTooEarlyDoNotMakeTheControlHunt) {
  for (const std::size_t late : {1U, 2U}) {
    for (const std::size_t delay : {0U, 1U}) {
      for (const double first_us : {20.0, 1000.0, 4000.0, 20000.0}) {
        for (const double factor : {0.04, 0.25, 0.8, 4.0, 25.0}) {
          const auto relative = brightness_of(with_step(factor), delay, late, first_us);
          const std::string where = std::to_string(late) + " late, delay " + std::to_string(delay) + ", first " +
                                    std::to_string(first_us) + ", step " + std::to_string(factor);
          for (const std::size_t i : {59U, 119U}) EXPECT_NEAR(relative[i], 1, 0.2) << where;
          for (std::size_t i = 105; i < 120; ++i) ASSERT_EQ(relative[i], relative[104]) << where << ", frame " << i;
        }
      }
    }
  }
}

TEST(ExposureLag, SettingsThatAreStatedRightlyAreBelieved) {
  for (const std::size_t delay : {0U, 1U, 3U}) {
    for (const double factor : {0.01, 0.04, 0.25, 0.8, 4.0, 25.0, 100.0}) {
      std::vector<double> lights = with_step(factor);
      for (std::size_t i = 70; i < 75; ++i) lights[i] = kLight;  // a gap in the clouds
      const Rig rig = rig_above_ground();
      const GroundMeter meter = GroundMeter::create(rig, rig.pairs[0], "").value();
      ExposureLag lag;
      std::vector<ExposureSettings> set(delay, {20, 1});
      ExposureSettings last{20, 1};
      for (const double light : lights) {
        set.push_back(last);
        const ExposureSettings taken = set[set.size() - 1 - delay];
        const auto ground = meter.measure(gray_frame(light * taken.exposure_us * taken.gain), Eigen::Vector3d::UnitZ());
        const ExposureSettings estimated = lag.add(ground, taken);
        ASSERT_EQ(estimated.exposure_us, taken.exposure_us);
        if (const auto wanted = ExposureControl(ExposureOptions()).update(ground, taken, 0)) last = *wanted;
      }
      EXPECT_EQ(lag.lag(), 0U);
    }
  }
}

}  // namespace
}  // namespace spartan::internal
