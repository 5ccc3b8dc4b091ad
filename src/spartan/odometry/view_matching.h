// Matching two images of unknown relative geometry, for the check of a calibration.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"

namespace spartan {

/// Corresponding points of two images, pixels.
struct ViewMatch {
  Eigen::Vector2d left, right;
  double sigma_px = 0;     ///< standard deviation of `right` along y, from the residual and the gradients
  double correlation = 0;  ///< normalized cross-correlation of the two patches
};

struct ViewMatchingOptions {
  int features = 2000;               ///< maximum number of features of an image, spread over it
  double descriptor_ratio = 0.8;     ///< maximum ratio of the nearest to the second nearest descriptor distance
  double min_correlation = 0.8;      ///< minimum normalized cross-correlation of the aligned patches
  double correlation_radius_px = 3;  ///< maximum distance of the alignment from the detected feature, pixels
};

/// Matches SURF features of both images: mutual nearest neighbours that pass the ratio test (Lowe, IJCV 60, 2004) are
/// aligned to sub-pixel accuracy. Neither rows nor a range of disparities are assumed, so a few of the matches are
/// wrong and callers must be robust against them. In order of the strength of the left features; identical for any
/// number of threads.
std::vector<ViewMatch> match_views(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                   const ViewMatchingOptions& options, const ThreadPool& workers);

}  // namespace spartan
