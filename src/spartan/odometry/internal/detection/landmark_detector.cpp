#include "spartan/odometry/internal/detection/landmark_detector.h"

#include <stdexcept>

#include "spartan/odometry/internal/detection/surf.h"

namespace spartan::internal {

double squared_distance(const Descriptor& a, const Descriptor& b) {
  int sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const int difference = a[i] - b[i];
    sum += difference * difference;
  }
  return sum / (254.0 * 254.0);
}

std::unique_ptr<LandmarkDetector> make_landmark_detector(const DetectionOptions& options, ThreadPool workers) {
  switch (options.detector) {
    case DetectorType::surf:
      return std::make_unique<SurfDetector>(options, std::move(workers));
  }
  throw std::invalid_argument("make_landmark_detector: unknown detector");
}

}  // namespace spartan::internal
