#include "spartan/imaging/exposure_control.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <vector>

namespace spartan {
namespace {

// A level camera of 64 x 64 px at 1 m: the lower half of its images is ground.
Rig rig_of(const PixelFormat& format = {}) {
  Rig rig;
  for (const char* name : {"left", "right"}) {
    Camera camera;
    camera.name = name;
    camera.size = {64, 64};
    camera.model = PinholeModel{64, 64, 31.5, 31.5};
    camera.pixel_format = format;
    Eigen::Matrix3d body_from_camera;  // x forward, y left, z up
    body_from_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    camera.mount_from_camera = Pose(body_from_camera, {0, name[0] == 'l' ? 0.1 : -0.1, 1});
    rig.cameras.push_back(camera);
  }
  StereoPair pair;
  pair.name = "pair";
  pair.left = "left";
  pair.right = "right";
  pair.nearest_m = 2;
  rig.pairs.push_back(pair);
  return rig;
}

template <class Pixel>
StereoFrame frame_of(const PixelFormat& format, int sky, int ground) {
  Image<Pixel> image(64, 64);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) image(x, y) = static_cast<Pixel>(y < 32 ? sky : ground);
  }
  StereoFrame frame;
  frame.pair = "pair";
  frame.left = FrameImage::own(std::move(image), format);
  frame.right = frame.left;
  return frame;
}

GroundMeter meter_of(const Rig& rig) {
  return GroundMeter::create(rig, rig.pairs[0], "").value();
}

TEST(GroundMeter, MeasuresTheGroundAndNotTheSky) {
  const auto measured = meter_of(rig_of()).measure(frame_of<std::uint8_t>({}, 255, 51), Eigen::Vector3d::UnitZ());
  EXPECT_NEAR(measured.median, 0.2, 0.002);
  EXPECT_NEAR(measured.high, 0.2, 0.002);
  EXPECT_EQ(measured.saturated, 0);
  EXPECT_NEAR(measured.ground, 0.45, 0.05) << "the horizon is in the middle";
}

TEST(GroundMeter, FollowsTheTiltOfTheRover) {
  const GroundMeter meter = meter_of(rig_of());
  const StereoFrame frame = frame_of<std::uint8_t>({}, 255, 51);
  // Pitched up by 20 degrees: of 53 degrees of view less than a quarter remains ground.
  const Eigen::Vector3d up(std::sin(0.35), 0, std::cos(0.35));
  EXPECT_LT(meter.measure(frame, up).ground, 0.25);
  EXPECT_NEAR(meter.measure(frame, up).median, 0.2, 0.002);
  const auto sky_alone = meter.measure(frame, Eigen::Vector3d(1, 0, 0));
  EXPECT_LT(sky_alone.ground, 0.05);
  EXPECT_GT(sky_alone.saturated, 0.4) << "where there is no ground, the whole image counts";
}

TEST(GroundMeter, KnowsAllPixelFormats) {
  for (const PixelFormat& format : {PixelFormat{PixelLayout::gray, 12}, PixelFormat{PixelLayout::bayer_rggb, 10},
                                    PixelFormat{PixelLayout::gray, 12, BitAlignment::high}}) {
    const int ground = format.full_scale() / 5;
    const auto measured =
        meter_of(rig_of(format))
            .measure(frame_of<std::uint16_t>(format, format.full_scale(), ground), Eigen::Vector3d::UnitZ());
    EXPECT_NEAR(measured.median, 0.2, 0.002);
    EXPECT_EQ(measured.saturated, 0);
  }
}

TEST(GroundMeter, MeasuresAboveTheBlackLevel) {
  const PixelFormat format{PixelLayout::gray, 12};
  Rig rig = rig_of(format);
  for (Camera& camera : rig.cameras) {
    camera.driver.emplace();
    camera.driver->black_level = 256;
  }
  const auto measure = [&](int ground) {
    return meter_of(rig).measure(frame_of<std::uint16_t>(format, 4095, ground), Eigen::Vector3d::UnitZ());
  };
  EXPECT_NEAR(measure(256 + 384).median, 0.1, 0.002) << "384 of 3839";
  EXPECT_LT(measure(250).median, 0.001);
  EXPECT_EQ(measure(4095).saturated, 1);
}

TEST(GroundMeter, ASelfMaskThatCannotBeReadIsAnError) {
  Rig rig = rig_of();
  rig.cameras[1].self_mask = "nowhere.png";
  const auto meter = GroundMeter::create(rig, rig.pairs[0], "");
  ASSERT_FALSE(meter);
  EXPECT_EQ(meter.error().code, ErrorCode::configuration);
}

// Ground whose brightness is log-normal around `light` x exposure x gain, on a black level, cut off at full scale.
GroundBrightness seen(double light, const ExposureSettings& settings, double black = 0.02) {
  const double median = black + light * settings.exposure_us * settings.gain;
  const double high = black + 2 * light * settings.exposure_us * settings.gain;
  GroundBrightness ground;
  ground.median = std::clamp(median, 0.5 / 1024, 1.0);
  ground.high = std::clamp(high, 0.5 / 1024, 1.0);
  ground.saturated = median >= 1 ? 0.6 : high >= 1 ? 0.03 : 0;
  ground.ground = 0.5;
  return ground;
}

// The settings of each frame; a setting has effect `delay` frames later.
std::vector<ExposureSettings> closed_loop(const ExposureControl& control, const std::vector<double>& lights, int delay,
                                          ExposureSettings settings, double motion_px_s = 0) {
  std::vector<ExposureSettings> taken;
  std::deque<ExposureSettings> underway(static_cast<std::size_t>(delay), settings);
  for (const double light : lights) {
    underway.push_back(settings);
    taken.push_back(underway.front());
    underway.pop_front();
    const auto wanted = control.update(seen(light, taken.back()), taken.back(), motion_px_s);
    if (wanted) settings = *wanted;
  }
  return taken;
}

TEST(ExposureControl, SettlesFromAnyExposureAndStays) {
  const ExposureControl control{ExposureOptions()};
  const double light = 0.3 / 2000;  // 2 ms give the level
  for (const double first_us : {20.0, 100.0, 1000.0, 4000.0, 20000.0}) {
    for (const int delay : {0, 1, 3}) {
      const auto taken = closed_loop(control, std::vector<double>(60, light), delay, {first_us, 1});
      const auto settled = static_cast<std::size_t>(5 * (delay + 1));
      for (std::size_t i = settled; i < taken.size(); ++i) {
        const double level = light * taken[i].exposure_us * taken[i].gain;
        ASSERT_NEAR(level, 0.3, 0.3 * 0.2) << first_us << " us, " << delay << " frames late, frame " << i;
        const double before_us = taken[std::max(i, settled + 1) - 1].exposure_us;
        ASSERT_EQ(taken[i].exposure_us, before_us) << "no hunting";
      }
    }
  }
}

TEST(ExposureControl, DoesNotFollowSmallChanges) {
  const ExposureControl control{ExposureOptions()};
  std::vector<double> lights;
  lights.reserve(100);  // with the black level, 2 ms give the level
  for (int i = 0; i < 100; ++i) lights.push_back(0.28 / 2000 * (1 + 0.08 * std::sin(i)));
  const auto taken = closed_loop(control, lights, 1, {2000, 1});
  for (const ExposureSettings& settings : taken) EXPECT_EQ(settings.exposure_us, 2000);
}

TEST(ExposureControl, MotionBlurLimitsTheExposureUntilTheGainIsLargest) {
  ExposureOptions options;
  options.most_blur_px = 0.5;
  const ExposureControl control(options);
  const double motion_px_s = 250;  // 0.5 px in 2 ms
  const auto last = [&](double light) {
    return closed_loop(control, std::vector<double>(40, light), 1, {500, 1}, motion_px_s).back();
  };
  const ExposureSettings sunny = last(0.3 / 1000), dim = last(0.3 / 8000), dark = last(0.3 / 64000);
  EXPECT_NEAR(sunny.exposure_us, 1000, 200);
  EXPECT_EQ(sunny.gain, 1);
  EXPECT_DOUBLE_EQ(dim.exposure_us, 2000);
  EXPECT_NEAR(dim.gain, 4, 0.8);
  EXPECT_DOUBLE_EQ(dark.gain, 16);
  EXPECT_NEAR(dark.exposure_us, 4000, 800) << "better blurred than dark";
}

// A camera takes settings within its bounds only, and states what it took.
std::vector<ExposureSettings> loop_with_camera(const std::vector<double>& lights, double motion_px_s,
                                               const ExposureBounds& bounds, int& sent) {
  const ExposureControl control{ExposureOptions()};
  ExposureSettings settings{500, bounds.smallest_gain};
  std::vector<ExposureSettings> taken;
  for (const double light : lights) {
    taken.push_back(settings);
    const auto wanted = control.update(seen(light, settings), settings, motion_px_s, bounds);
    if (!wanted) continue;
    ++sent;
    if (wanted->exposure_us >= bounds.shortest_us && wanted->exposure_us <= bounds.longest_us)
      settings.exposure_us = wanted->exposure_us;
    if (wanted->gain >= bounds.smallest_gain && wanted->gain <= bounds.largest_gain) settings.gain = wanted->gain;
  }
  return taken;
}

TEST(ExposureControl, ACameraWithoutGainIsExposedLongerAndSettles) {
  const double motion_px_s = 250;  // 1 px in 4 ms
  const ExposureBounds no_gain{10, 1e6, 1, 1};
  const double bright = 0.28 / 2000;
  std::vector<double> lights(20, bright);
  lights.insert(lights.end(), 40, bright / 8);
  int sent = 0;
  const auto taken = loop_with_camera(lights, motion_px_s, no_gain, sent);
  EXPECT_NEAR(taken.back().exposure_us, 16000, 0.2 * 16000) << "beyond the blur limit, where gain cannot help";
  EXPECT_LT(sent, 12) << "settings are not sent again";
  for (std::size_t i = 40; i < taken.size(); ++i) EXPECT_EQ(taken[i].exposure_us, taken.back().exposure_us);
}

TEST(ExposureControl, KeepsToTheBoundsOfTheCameras) {
  const double dark = 0.3 / 1e6;
  const ExposureBounds bounds{100, 5000, 1.5, 15.8};
  int sent = 0;
  const ExposureSettings last = loop_with_camera(std::vector<double>(30, dark), 250, bounds, sent).back();
  EXPECT_EQ(last.exposure_us, 5000);
  EXPECT_EQ(last.gain, 15.8);
  EXPECT_LT(sent, 10) << "at the bounds nothing is left to change";
  const ExposureSettings glaring = loop_with_camera(std::vector<double>(30, 1), 250, bounds, sent).back();
  EXPECT_EQ(glaring.exposure_us, 100);
  EXPECT_EQ(glaring.gain, 1.5);
}

TEST(ExposureControl, KeepsHighlightsButNotAtAnyPrice) {
  const ExposureControl control{ExposureOptions()};
  GroundBrightness ground{0.3, 0.9, 0, 0.5};
  EXPECT_FALSE(control.update(ground, {1000, 1}, 0));
  ground.high = 1;
  const auto darker = control.update(ground, {1000, 1}, 0);
  ASSERT_TRUE(darker);
  EXPECT_LT(darker->exposure_us, 700);
  ground = {0.1, 1, 0.05, 0.5};
  EXPECT_FALSE(control.update(ground, {1000, 1}, 0)) << "a third of the level";
}

TEST(ExposureControl, NeedsToKnowHowAFrameWasTaken) {
  EXPECT_FALSE(ExposureControl{ExposureOptions()}.update({1, 1, 1, 0.5}, {0, 0}, 0));
}

TEST(GroundMotion, IsThatOfTheNearestGround) {
  const Rig rig = rig_of();
  Vector6d velocity = Vector6d::Zero();
  velocity(0) = 0.5;
  EXPECT_NEAR(ground_motion_px_s(rig, rig.pairs[0], velocity), 64 * 0.25, 0.5);
  velocity(5) = 0.1;
  EXPECT_NEAR(ground_motion_px_s(rig, rig.pairs[0], velocity), 64 * 0.35, 0.5);
}

}  // namespace
}  // namespace spartan
