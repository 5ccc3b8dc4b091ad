// Test fixture of this module: a rendered drive with its true poses.
#pragma once

#include <cmath>
#include <vector>

#include "spartan/odometry/odometer.h"
#include "spartan/testing/synthetic_world.h"

namespace spartan::synthetic_drive {

using testing::SyntheticFrame;
using testing::SyntheticWorld;

inline const RectifiedStereo kCameras{{320, 240}, 246.0, {159.5, 119.5}, 0.12};

/// A camera half a metre above level ground, tilted 32° down, heading `heading_rad` to the left of world x.
inline Pose camera_at(double x, double y, double heading_rad) {
  const double s = std::sin(0.55), c = std::cos(0.55);
  Eigen::Matrix3d body_from_optical;
  body_from_optical << 0, -s, c, -1, 0, 0, 0, -c, -s;
  return Pose(exp_so3({0, 0, heading_rad}), {x, y, 0.5}) * Pose(body_from_optical, {0, 0, 0});
}

/// A curved drive: 4 cm and 0.8° per frame.
inline Pose true_pose(int frame) {
  const double heading = 0.014 * frame, radius = 0.04 / 0.014;
  return camera_at(radius * std::sin(heading), radius * (1 - std::cos(heading)), heading);
}

/// Frames are rendered once for all tests.
inline const SyntheticFrame& frame_of(int index) {
  static const std::vector<SyntheticFrame> frames = [] {
    const SyntheticWorld world(testing::SyntheticWorldOptions{});
    std::vector<SyntheticFrame> rendered;
    rendered.reserve(10);
    for (int i = 0; i < 10; ++i)
      rendered.push_back(world.render(kCameras, true_pose(i), static_cast<std::uint64_t>(i)));
    return rendered;
  }();
  return frames[static_cast<std::size_t>(index)];
}

inline RectifiedPair pair_of(const SyntheticFrame& frame, int time) {
  RectifiedPair pair;
  pair.stamp.ns = time * 1'000'000'000LL;
  pair.geometry = kCameras;
  pair.left = frame.left;
  pair.right = frame.right;
  return pair;
}

inline RectifiedPair pair_of(int index) {
  return pair_of(frame_of(index), index);
}

inline RectifiedPair blank_pair(const Image<std::uint8_t>& blank, int time) {
  RectifiedPair pair = pair_of(0);
  pair.stamp.ns = time * 1'000'000'000LL;
  pair.left = blank;
  pair.right = blank;
  return pair;
}

inline Pose true_motion(int from, int to) {
  return true_pose(from).inverse() * true_pose(to);
}

inline double translation_error(const MotionEstimate& estimate, int from, int to) {
  return (true_motion(from, to).inverse() * estimate.previous_from_current).translation().norm();
}

inline double rotation_error(const MotionEstimate& estimate, int from, int to) {
  return rotation_angle(true_motion(from, to).inverse() * estimate.previous_from_current);
}

/// An odometer that has processed that many frames of the drive.
inline Odometer after_frames(int count) {
  Odometer odometer = Odometer::create({}, ThreadPool(1)).value();
  for (int i = 0; i < count; ++i) odometer.add(pair_of(i));
  return odometer;
}

}  // namespace spartan::synthetic_drive
