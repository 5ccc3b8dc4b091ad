// Matching two pictures of which nothing is known: for the check of a calibration.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"

namespace spartan {

/// The same place in two pictures, pixels.
struct ViewMatch {
  Eigen::Vector2d left, right;
  double sigma_px = 0;     ///< of `right`, from the residual and the texture
  double correlation = 0;  ///< normalised, of the two surroundings
};

struct ViewMatchingOptions {
  int features = 2000;            ///< at most so many a picture, spread over it
  double descriptor_ratio = 0.8;  ///< nearest over second nearest descriptor
  double min_correlation = 0.8;
  double correlation_reach_px = 3;
};

/// SURF features of both pictures; those whose descriptors are each other's nearest, and clearly nearer than the second
/// one, are aligned to sub-pixel by correlation. Neither rows nor a range of disparities are presumed: a few of the
/// matches may be wrong, and callers must bear that. Ordered by the strength of the left features; the same for any
/// number of threads.
std::vector<ViewMatch> match_views(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                   const ViewMatchingOptions& options, const Workers& workers);

}  // namespace spartan
