// The check of one pair of a rig with images.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "spartan/calibration/pair_check.h"
#include "spartan/core/image.h"

namespace spartan::program {

/// The result of the check, and the frame with the most matches, which the figure shows.
struct InspectedPair {
  StereoPair pair;
  PairCheck check;
  std::string frame;
  Image<std::uint8_t> left, right;
  std::vector<PixelMatch> matches;

  /// Whether the images were sufficient: enough matches, cameras side by side, two different images.
  bool checked() const { return std::isfinite(check.correction.pitch_rad); }
};

}  // namespace spartan::program
