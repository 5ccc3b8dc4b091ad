// Harris corners with SURF descriptors.
// Source: Harris, Stephens, "A combined corner and edge detector", Alvey Vision Conference 1988.
#pragma once

#include <vector>

#include "spartan/odometry/internal/detection/integral_image.h"
#include "spartan/odometry/internal/detection/landmark_detector.h"

namespace spartan::internal {

/// Detects corners as maxima of det M − k (trace M)², with M the structure tensor of a window, at one scale, and
/// describes each by a SURF descriptor of a fixed scale.
class HarrisDetector final : public LandmarkDetector {
 public:
  HarrisDetector(const DetectionOptions& options, ThreadPool workers);
  using LandmarkDetector::detect;
  const std::vector<Feature>& detect(ImageView<const std::uint8_t> image, ImageView<const std::uint8_t> mask,
                                     const WantedFeatures& wanted) override;

 private:
  void find_maxima(int margin);
  DetectionOptions options_;
  ThreadPool workers_;
  IntegralImage integral_;
  Image<float> response_;
  std::vector<Feature> found_, features_;
};

}  // namespace spartan::internal
