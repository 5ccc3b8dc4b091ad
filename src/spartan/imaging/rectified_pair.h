// A rectified stereo pair: output of imaging, input of reconstruction and odometry.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/core/stage_clock.h"
#include "spartan/core/time.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// Two rectified images with common rows, 8-bit gray after the contrast step. The views borrow the buffers of their
/// producer (an `Imager` keeps them until its next frame of the pair).
struct RectifiedPair {
  std::string pair;
  Stamp stamp;  ///< of the left image
  RectifiedStereo geometry;
  ImageView<const std::uint8_t> left, right;
  /// 255 where the pixel is inside the sensor and outside the self-mask, else 0; empty: valid everywhere.
  ImageView<const std::uint8_t> left_mask, right_mask;
  std::vector<StageTime> times;  ///< durations of the steps ("imaging.debayer" …), for reports only
  Pose body_from_left;           ///< pose of the rectified left optical frame at the pan and tilt of this frame
};

}  // namespace spartan
