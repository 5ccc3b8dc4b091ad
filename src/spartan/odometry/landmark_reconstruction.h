// Landmark 3D reconstruction: the published sub-module. The disparity of single places by a search along the row.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "spartan/core/image.h"
#include "spartan/odometry/odometry_options.h"
#include "spartan/odometry/patch_alignment.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

/// One shot as the sub-steps need it; all views borrowed.
struct StereoImages {
  RectifiedStereo geometry;
  ImageView<const std::uint8_t> left, right;
  ImageView<const std::uint16_t> left_smooth, right_smooth;  ///< gray levels times 256
  ImageView<const std::uint8_t> left_mask, right_mask;       ///< 255 valid; empty: everywhere
  ImageView<const float> disparity;                          ///< dense, of the left image; may be empty
};

class LandmarkReconstruction {
 public:
  explicit LandmarkReconstruction(const LandmarkReconstructionOptions& options) : options_(options) {}

  /// Disparity of a whole pixel of the left image, searched over the full range: best normalised correlation along the
  /// row, unique, the same from right to left, then aligned to sub-pixel. Nothing where that fails. From the dense
  /// image instead where the options say so and there is one.
  std::optional<RowAlignment> reconstruct(const StereoImages& images, int x, int y) const;

  /// Disparity of a sub-pixel place near a prediction (disparity and slant), within `reach_px`.
  std::optional<RowAlignment> refine(const StereoImages& images, const Eigen::Vector2d& pixel,
                                     const RowAlignment& predicted, double reach_px) const;

 private:
  std::optional<RowAlignment> from_dense(const StereoImages& images, int x, int y) const;
  std::optional<double> search(const StereoImages& images, int x, int y, int least, int most) const;
  std::optional<RowAlignment> align(const StereoImages& images, const Eigen::Vector2d& pixel, const RowAlignment& start,
                                    double reach_px) const;
  LandmarkReconstructionOptions options_;
};

}  // namespace spartan
