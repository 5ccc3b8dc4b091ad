// What pictures said about one pair of a rig.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/rig/inspection/pair_check.h"

namespace spartan::program {

/// With the shot that is drawn.
struct InspectedPair {
  StereoPair pair;
  PairCheck check;
  std::string shot;
  Image<std::uint8_t> left, right;
  std::vector<PixelMatch> matches;

  /// Whether there was anything to judge by: matches enough, eyes beside each other, two different pictures.
  bool judged() const { return std::isfinite(check.correction.pitch_rad); }
};

}  // namespace spartan::program
