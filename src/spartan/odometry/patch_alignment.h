// Aligning a small image patch with an image to sub-pixel accuracy.
// Source: Baker & Matthews, "Lucas-Kanade 20 years on: a unifying framework", IJCV 56 (2004).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "spartan/core/image.h"

namespace spartan {

/// Windows are 13×13 pixels; patches carry one more pixel on each side for the gradients.
inline constexpr int kWindowRadius = 6;
inline constexpr int kWindowSide = 2 * kWindowRadius + 1;
inline constexpr int kWindowArea = kWindowSide * kWindowSide;
inline constexpr int kPatchSide = kWindowSide + 2;

/// The surroundings of a pixel in a smoothed image, gray levels times 256, row by row.
using ImagePatch = std::array<std::uint16_t, kPatchSide * kPatchSide>;

/// Around a whole pixel; nothing where the patch leaves the image.
std::optional<ImagePatch> cut_patch(ImageView<const std::uint16_t> image, int x, int y);

/// A window of gray levels with its gradients, ready to be found again. Offsets run over the window row by row.
class AlignmentTemplate {
 public:
  explicit AlignmentTemplate(const ImagePatch& patch);
  /// Around a sub-pixel place of a smoothed image; nothing where it leaves the image.
  static std::optional<AlignmentTemplate> around(ImageView<const std::uint16_t> image, const Eigen::Vector2d& centre);

  /// Weighted mean taken off; `deviation` is the weighted standard deviation, gray levels.
  std::array<float, kWindowArea> value, gradient_x, gradient_y;
  float deviation = 0;

 private:
  explicit AlignmentTemplate(const std::array<float, kPatchSide * kPatchSide>& pixels);
};

/// Where a template was found.
struct Alignment {
  Eigen::Vector2d position;    ///< of the template's centre, pixels
  Eigen::Matrix2d covariance;  ///< from the residual and the texture, pixels²
  double correlation = 0;      ///< normalised, at the end
};

/// Moves the centre so that image(centre + warp · offset) is like template(offset) up to brightness and contrast
/// (translation only; inverse-compositional normal equations). Nothing where it leaves the image, does not settle or
/// goes further than `reach_px` from the start.
std::optional<Alignment> align_translation(const AlignmentTemplate& wanted, ImageView<const std::uint16_t> image,
                                           const Eigen::Matrix2d& warp, const Eigen::Vector2d& start, double reach_px);

struct RowAlignment {
  double disparity = 0;
  Eigen::Vector2d slant = Eigen::Vector2d::Zero();  ///< ∂disparity/∂(x, y) in the left image
  double sigma_px = 0;                              ///< of the disparity, from the residual and the texture
  double correlation = 0;
};

/// Finds disparity and slant so that right(centre + offset − (disparity + slant · offset, 0)) is like the template,
/// which was taken around `centre` of the left image. A slant is held near its start by a weak prior; with
/// `estimate_slant` false it stays.
std::optional<RowAlignment> align_along_row(const AlignmentTemplate& wanted, ImageView<const std::uint16_t> right,
                                            const Eigen::Vector2d& centre, const RowAlignment& start,
                                            bool estimate_slant, double reach_px);

/// Where a template of the left eye was found in the right one when neither row nor slant are known.
struct SlantedAlignment {
  Alignment place;
  Eigen::Vector2d slant = Eigen::Vector2d::Zero();  ///< ∂disparity/∂(x, y) in the left image
};

/// As align_translation with the surface's slant estimated along: right(centre + offset − (slant · offset, 0)) is like
/// the template. Without it, slanted edges of slanted ground draw a match up or down. A weak prior holds the slant near
/// 0.
std::optional<SlantedAlignment> align_slanted(const AlignmentTemplate& wanted, ImageView<const std::uint16_t> right,
                                              const Eigen::Vector2d& start, double reach_px);

}  // namespace spartan
