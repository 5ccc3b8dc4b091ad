// Landmark detection, a sub-module of the published odometry; further detectors can be added.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/odometry/internal/detection/descriptor.h"
#include "spartan/odometry/odometer.h"

namespace spartan::internal {

/// A distinctive point of an image.
struct Feature {
  float x = 0, y = 0;    ///< sub-pixel position, pixels
  float scale = 0;       ///< standard deviation of the blob, pixels
  float angle = 0;       ///< orientation, rad; 0 where the detector is upright
  float strength = 0;    ///< detector response, comparable within one image
  std::int8_t sign = 0;  ///< dark (+1) or bright (−1) blob, 0 where unknown; features of different sign never match
  Descriptor descriptor{};
};

/// Which features are wanted.
struct WantedFeatures {
  std::optional<int> count;                ///< maximum number; without it DetectionOptions::landmarks
  std::span<const Eigen::Vector2f> taken;  ///< positions that have landmarks already: no feature near them
};

/// Detects features in order of decreasing strength, spread over the image, identical for any number of threads. A
/// further detector is one file with a class like this, a value of DetectorType and one case in
/// make_landmark_detector() (CONTRIBUTING.md, "A detector").
class LandmarkDetector {
 public:
  virtual ~LandmarkDetector() = default;
  /// `mask`: 255 where features are allowed; empty: everywhere. The result is valid until the next call.
  virtual const std::vector<Feature>& detect(ImageView<const std::uint8_t> image, ImageView<const std::uint8_t> mask,
                                             const WantedFeatures& wanted) = 0;
  const std::vector<Feature>& detect(ImageView<const std::uint8_t> image, ImageView<const std::uint8_t> mask) {
    return detect(image, mask, {});
  }
};

/// Makes the detector that the options select. Throws std::invalid_argument where the value is none of DetectorType.
std::unique_ptr<LandmarkDetector> make_landmark_detector(const DetectionOptions& options, ThreadPool workers);

}  // namespace spartan::internal
