// Aligning a small image patch with an image to sub-pixel accuracy.
// Source: Baker & Matthews, "Lucas-Kanade 20 years on: a unifying framework", IJCV 56 (2004).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "spartan/core/image.h"
#include "spartan/odometry/internal/matching/window_kernels.h"

namespace spartan::internal {

/// 15×15 pixels around a pixel of a smoothed image, gray levels times 256, row by row; rows of 16, and a sixteenth row,
/// hold 0 behind them.
using ImagePatch = std::array<std::uint16_t, static_cast<std::size_t>(kWindowStride* kWindowStride)>;

/// The patch around a whole pixel; std::nullopt where it leaves the image.
std::optional<ImagePatch> cut_patch(ImageView<const std::uint16_t> image, int x, int y);

/// A window of gray levels and its gradients, the template of an alignment.
struct AlignmentTemplate {
  explicit AlignmentTemplate(const ImagePatch& patch);
  /// Around a sub-pixel position of a smoothed image; std::nullopt where the window leaves the image.
  static std::optional<AlignmentTemplate> around(ImageView<const std::uint16_t> image, const Eigen::Vector2d& centre);

  WindowGradients window;          ///< gray levels without their weighted mean `level`
  float level = 0, deviation = 0;  ///< weighted mean and standard deviation

 private:
  explicit AlignmentTemplate(const WindowGradients& gradients);
};

/// Result of an alignment.
struct PatchAlignment {
  Eigen::Vector2d position;    ///< of the template's centre, pixels
  Eigen::Matrix2d covariance;  ///< from the residual and the gradients, pixels²
  double correlation = 0;      ///< normalized cross-correlation at the result
};

/// Estimates the centre so that image(centre + warp · offset) ≈ template(offset) up to contrast, a plane of brightness
/// and, to first order, the scale of the warp (inverse-compositional Gauss-Newton, Baker & Matthews §3.2). std::nullopt
/// where the window leaves the image, the iteration does not converge or moves farther than `radius_px` from the start.
std::optional<PatchAlignment> align_translation(const AlignmentTemplate& reference,
                                                ImageView<const std::uint16_t> image, const Eigen::Matrix2d& warp,
                                                const Eigen::Vector2d& start, double radius_px);

/// Disparity of a patch from an alignment along the image row.
struct RowAlignment {
  double disparity = 0;                             ///< pixels
  Eigen::Vector2d slant = Eigen::Vector2d::Zero();  ///< disparity gradient ∂d/∂(x, y) in the left image
  double sigma_px = 0;                              ///< of the disparity, from the residual and the gradients
  double correlation = 0;                           ///< normalized cross-correlation at the result
};

/// Estimates disparity and slant so that right(centre + offset − (disparity + slant · offset, 0)) ≈ template(offset),
/// for a template around `centre` of the left image. A weak Gaussian prior keeps the slant near its start; with
/// `estimate_slant` false the slant is fixed. std::nullopt as for align_translation().
std::optional<RowAlignment> align_along_row(const AlignmentTemplate& reference, ImageView<const std::uint16_t> right,
                                            const Eigen::Vector2d& centre, const RowAlignment& start,
                                            bool estimate_slant, double radius_px);

/// Alignment of a left template in the right image where neither row nor slant is known.
struct SlantedAlignment {
  PatchAlignment match;
  Eigen::Vector2d slant = Eigen::Vector2d::Zero();  ///< disparity gradient ∂d/∂(x, y) in the left image
};

/// align_translation() that estimates the slant of the surface as well: right(centre + offset − (slant · offset, 0)) ≈
/// template(offset). Without the slant, oblique edges on slanted ground bias the row of the match. A weak Gaussian
/// prior keeps the slant near 0.
std::optional<SlantedAlignment> align_slanted(const AlignmentTemplate& reference, ImageView<const std::uint16_t> right,
                                              const Eigen::Vector2d& start, double radius_px);

}  // namespace spartan::internal
