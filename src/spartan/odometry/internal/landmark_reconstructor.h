// Landmark 3D reconstruction, a sub-module of the published odometry: the disparity of single pixels by a search along
// the image row.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/odometry/internal/detection/landmark_detector.h"
#include "spartan/odometry/internal/matching/patch_alignment.h"
#include "spartan/odometry/odometer.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan::internal {

/// The images of one rectified stereo frame; all views are borrowed.
struct StereoImages {
  RectifiedStereo geometry;
  ImageView<const std::uint8_t> left, right;                 ///< one may be empty: it is missing
  ImageView<const std::uint16_t> left_smooth, right_smooth;  ///< SmoothedImage, gray levels times 256
  ImageView<const std::uint8_t> left_mask, right_mask;       ///< 255 valid; empty: everywhere
  ImageView<const float> disparity;                          ///< dense, of the left image, NaN unknown; may be empty
};

/// A feature of the current frame and its disparity at the nearest whole pixel, where one was found.
struct ReconstructedFeature {
  Feature feature;
  std::optional<RowAlignment> stereo;
};

class LandmarkReconstructor {
 public:
  explicit LandmarkReconstructor(const LandmarkReconstructionOptions& options) : options_(options) {}

  /// Disparity of a whole pixel of the left image, searched over the full range: maximum of the normalized
  /// cross-correlation along the row, with a uniqueness test and a left-right consistency check, then aligned to
  /// sub-pixel accuracy. Read from the dense disparity image instead where the options say so and there is one.
  /// std::nullopt where a test fails or the right image is missing.
  std::optional<RowAlignment> reconstruct(const StereoImages& images, int x, int y) const;

  /// Each feature with the disparity of its nearest whole pixel.
  std::vector<ReconstructedFeature> reconstruct(const StereoImages& images, const std::vector<Feature>& features,
                                                ThreadPool& workers) const;

  /// Disparity of a sub-pixel position within `radius_px` of a predicted disparity (and slant).
  std::optional<RowAlignment> refine(const StereoImages& images, const Eigen::Vector2d& pixel,
                                     const RowAlignment& predicted, double radius_px) const;

 private:
  std::optional<RowAlignment> from_dense(const StereoImages& images, int x, int y) const;
  std::optional<double> search(const StereoImages& images, int x, int y, int min_disparity, int max_disparity) const;
  std::optional<RowAlignment> align(const StereoImages& images, const Eigen::Vector2d& pixel, const RowAlignment& start,
                                    double radius_px) const;
  LandmarkReconstructionOptions options_;
};

}  // namespace spartan::internal
