// A rover with a wide and a narrow pair over a synthetic world, for tests of the maps.
#pragma once

#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "spartan/camera/samples.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/synthetic_world.h"

namespace spartan::testing {

inline const RectifiedStereo kWide{{320, 320}, 340, {159.5, 159.5}, 0.2};
inline const RectifiedStereo kNarrow{{320, 240}, 250, {159.5, 119.5}, 0.12};
inline constexpr double kStopDistance_m = 0.15;

/// Wide cameras on a mast, 1 m high and 35° down, narrow ones at half a metre.
inline Rig mapping_rover() {
  const auto add = [](Rig& rig, const std::string& pair, const RectifiedStereo& stereo, const Pose& body_from_left) {
    for (const char* side : {"left", "right"}) {
      Camera camera;
      camera.name = pair + "_" + side;
      camera.size = stereo.size;
      camera.model = PinholeModel{stereo.focal_px, stereo.focal_px, stereo.centre_px.x(), stereo.centre_px.y()};
      camera.mount_from_camera =
          body_from_left * Pose::from_translation({side == std::string("left") ? 0 : stereo.baseline_m, 0, 0});
      rig.cameras.push_back(camera);
    }
  };
  const auto camera_at = [](double height_m, double tilt_rad) {
    return Pose(exp_so3({0, tilt_rad, 0}), {0, 0, height_m}) * optical_from_forward().inverse();
  };
  Rig rig;
  rig.name = "rover";
  add(rig, "wide", kWide, camera_at(1, 0.6));
  add(rig, "narrow", kNarrow, camera_at(0.5, 0.55));
  rig.pairs = {{"wide", "wide_left", "wide_right", 0.6, false}, {"narrow", "narrow_left", "narrow_right", 0.4, true}};
  rig.calibration_errors = CalibrationErrors{0, 0, 0, 0, 0};  // it takes the images
  return rig;
}

/// At equal distances along x.
inline Pose pose_at(int index) {
  return Pose::from_translation({kStopDistance_m * index, 0, 0});
}

/// Rendered at the first call, then cached.
inline const SyntheticFrame& images_of(const std::string& pair, int index) {
  static const SyntheticWorld world = [] {
    SyntheticWorldOptions options;
    options.relief_m = 0.03;
    options.stones_per_m2 = 6;
    options.stone_size_m = 0.2;
    return SyntheticWorld(options);
  }();
  static std::map<std::pair<std::string, int>, SyntheticFrame> rendered;
  const auto key = std::pair(pair, index);
  const auto found = rendered.find(key);
  if (found != rendered.end()) return found->second;
  const Pose body_from_left = mapping_rover().body_from_camera(pair + "_left");
  return rendered
      .emplace(key, world.render(pair == "wide" ? kWide : kNarrow, pose_at(index) * body_from_left,
                                 static_cast<std::uint64_t>(pair == "wide" ? 100 + index : index)))
      .first->second;
}

/// At the stop `position_id`.
inline StereoFrame frame_of(const SyntheticFrame& images, const std::string& pair, int position_id, double seconds) {
  StereoFrame frame;
  frame.frame_id = position_id;
  frame.position_id = position_id;
  frame.pair = pair;
  frame.left_stamp = frame.right_stamp = Stamp::from_seconds(seconds);
  // The noise of a real camera differs at any time; equal images would be rejected as frozen.
  const auto noisy = [seconds](const Image<std::uint8_t>& image) {
    Image<std::uint8_t> copy = image.clone();
    copy(0, 0) = static_cast<std::uint8_t>(std::lround(10 * seconds) & 255);
    return FrameImage::own(std::move(copy), {});
  };
  frame.left = noisy(images.left);
  frame.right = noisy(images.right);
  return frame;
}

}  // namespace spartan::testing
