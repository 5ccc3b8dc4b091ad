#include "spartan/odometry/internal/detection/landmark_detector.h"

#include <stdexcept>

#include "spartan/odometry/internal/detection/harris.h"
#include "spartan/odometry/internal/detection/opencv_detector.h"
#include "spartan/odometry/internal/detection/surf.h"

namespace spartan::internal {

std::unique_ptr<LandmarkDetector> make_landmark_detector(const DetectionOptions& options, ThreadPool workers) {
  switch (options.detector) {
    case DetectorType::surf:
      return std::make_unique<SurfDetector>(options, std::move(workers));
    case DetectorType::harris:
      return std::make_unique<HarrisDetector>(options, std::move(workers));
    case DetectorType::orb:
    case DetectorType::sift:
    case DetectorType::akaze:
      return std::make_unique<OpencvDetector>(options);
  }
  throw std::invalid_argument("make_landmark_detector: unknown detector");
}

}  // namespace spartan::internal
