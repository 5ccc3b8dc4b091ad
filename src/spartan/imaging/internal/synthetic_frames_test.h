// Cameras, rigs and frames for the tests of the imager.
#pragma once

#include <cmath>
#include <string>

#include "spartan/imaging/imager.h"

namespace spartan::testing {

inline constexpr ImageSize kImageSize{64, 48};

inline Camera camera(const std::string& name, PixelFormat format,
                     const CameraModel& model = PinholeModel{60, 60, 32, 24}) {
  Camera result;
  result.name = name;
  result.size = kImageSize;
  result.model = model;
  result.pixel_format = format;
  return result;
}

inline Rig rig_with(const PixelFormat& format, const Eigen::Vector3d& rotation = Eigen::Vector3d::Zero()) {
  return rig_of_one_pair("test", camera("left", format), camera("right", format),
                         Pose(exp_so3(rotation), {0.1, 0, 0}).inverse());
}

template <class T>
Image<T> ramp(int factor) {
  Image<T> image(kImageSize);
  for (int y = 0; y < kImageSize.height; ++y) {
    for (int x = 0; x < kImageSize.width; ++x) image(x, y) = static_cast<T>((x + y) * factor);
  }
  return image;
}

inline StereoFrame frame_of(const FrameImage& left, const FrameImage& right) {
  StereoFrame frame;
  frame.frame_id = 12;
  frame.pair = "stereo";
  frame.left_stamp = Stamp{42};
  frame.left = left;
  frame.right = right;
  return frame;
}

}  // namespace spartan::testing
