// What imaging hands to reconstruction and odometry.
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

/// Two images with common rows, 8-bit gray after the contrast stage. The views borrow the buffers of whoever made
/// the pair (an `Imager` keeps them until its next frame).
struct RectifiedPair {
  std::string pair;
  Stamp stamp;  ///< of the left image
  RectifiedStereo geometry;
  ImageView<const std::uint8_t> left, right;
  /// 255 where a camera has really looked and does not see the rover itself; empty: everywhere.
  ImageView<const std::uint8_t> left_mask, right_mask;
  std::vector<StageTime> times;  ///< "imaging.debayer" …, of what was done; for reports only
  Pose body_from_left;           ///< rectified left optical frame at this shot's pan and tilt
};

}  // namespace spartan
