// Places and scales of SURF features by Gaussian derivatives.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/odometry/internal/detection/landmark_detector.h"

namespace spartan::internal {

/// Moves features to the nearest maximum of the determinant of the Hessian of Gaussians over position and scale. Box
/// filters are not isotropic, and those of SURF sample the scale coarsely: their maxima move by up to half of the scale
/// where the image is rotated or scaled. Source: Lindeberg, "Feature detection with automatic scale selection", IJCV
/// 30, 1998; the refinement is that of Mikolajczyk, Schmid, "Scale & affine invariant interest point detectors", IJCV
/// 60, 2004, §3.1.
class SurfRefinement {
 public:
  /// Takes the image, which must stay until the last call of refined(), and makes its pyramid.
  void compute(ImageView<const std::uint8_t> image);
  /// None where there is no maximum within 3 samples of the feature and half an octave, three times over.
  std::optional<Feature> refined(const Feature& feature) const;

 private:
  static constexpr int kLevels = 5;
  ImageView<const std::uint8_t> image_;
  std::vector<Image<float>> halves_;  ///< the image at 1/2, 1/4 …
};

}  // namespace spartan::internal
