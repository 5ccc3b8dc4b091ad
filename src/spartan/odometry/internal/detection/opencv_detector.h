// The detectors ORB, SIFT and AKAZE of OpenCV.
#pragma once

#include <opencv2/features2d.hpp>
#include <vector>

#include "spartan/odometry/internal/detection/landmark_detector.h"

namespace spartan::internal {

/// Features of the detector that the options select, ORB, SIFT or AKAZE, with their own descriptors, spread over the
/// image as those of SURF. OpenCV runs on as many threads as cv::setNumThreads() says.
/// Sources: Rublee et al., "ORB: an efficient alternative to SIFT or SURF", ICCV 2011; Lowe, "Distinctive image
/// features from scale-invariant keypoints", IJCV 60, 2004; Alcantarilla, Nuevo, Bartoli, "Fast explicit diffusion for
/// accelerated features in nonlinear scale spaces", BMVC 2013.
class OpencvDetector final : public LandmarkDetector {
 public:
  /// Throws std::invalid_argument for another detector.
  explicit OpencvDetector(const DetectionOptions& options);
  using LandmarkDetector::detect;
  const std::vector<Feature>& detect(ImageView<const std::uint8_t> image, ImageView<const std::uint8_t> mask,
                                     const WantedFeatures& wanted) override;

 private:
  Feature to_feature(const cv::KeyPoint& keypoint) const;
  void describe(ImageView<const std::uint8_t> image, const std::vector<std::uint32_t>& selected);
  DetectionOptions options_;
  DescriptorKind kind_ = DescriptorKind::orb;
  cv::Ptr<cv::Feature2D> method_;
  std::vector<cv::KeyPoint> keypoints_;  ///< all of the image
  cv::Mat descriptors_;                  ///< a row each; of SIFT only of the selected ones
  std::vector<Feature> found_;           ///< where the mask allows them
  std::vector<std::size_t> keypoint_of_;
  std::vector<Feature> features_;
};

}  // namespace spartan::internal
