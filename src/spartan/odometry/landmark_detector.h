// Landmark detection: the published sub-module, open to further detectors.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/odometry/odometry_options.h"

namespace spartan {

/// A unit vector of 64 numbers, each times 254 and rounded (entries beyond ±1/2 saturate).
using Descriptor = std::array<std::int8_t, 64>;

/// Euclidean distance of the unit vectors that stand behind two descriptors, squared.
double squared_distance(const Descriptor& a, const Descriptor& b);

/// A place in one image that can be found again in others.
struct Feature {
  float x = 0, y = 0;    ///< pixels, sub-pixel
  float scale = 0;       ///< standard deviation of the blob, pixels
  float angle = 0;       ///< orientation, rad; 0 where the detector is upright
  float strength = 0;    ///< comparable within one image
  std::int8_t sign = 0;  ///< features of different sign are never the same: dark (+1) or bright (−1) blobs
  Descriptor descriptor{};
};

/// Finds features, strongest first, spread over the image, the same for any number of threads. A further detector
/// is one file with a class like this and one entry in make_landmark_detector() (CONTRIBUTING.md, "A detector").
class LandmarkDetector {
 public:
  virtual ~LandmarkDetector() = default;
  /// `mask`: 255 where features may lie; empty: everywhere. The result is valid until the next call.
  virtual const std::vector<Feature>& detect(ImageView<const std::uint8_t> image,
                                             ImageView<const std::uint8_t> mask) = 0;
};

/// By the name in the options; throws std::invalid_argument on an unknown one (option files are checked before).
std::unique_ptr<LandmarkDetector> make_landmark_detector(const DetectionOptions& options, Workers workers);

}  // namespace spartan
