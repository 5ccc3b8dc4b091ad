// A quarter and an eighth of an image, in which landmarks are found far from their predicted positions.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "spartan/core/image.h"

namespace spartan::internal {

/// Levels of a Gaussian pyramid (Burt & Adelson, IEEE Trans. Communications 31, 1983) by the binomial filter
/// [1 4 6 4 1]/16, in gray levels times 256. A position x of the image is at x / scale + margin in a level.
class ImagePyramid {
 public:
  static constexpr int kLevels = 2;
  static constexpr std::array<int, kLevels> kScale{4, 8};
  /// Border pixels are replicated this often, so that windows near the border lie inside.
  static constexpr int kMargin = 12;

  /// From an image that is already smoothed by the same filter.
  void compute(ImageView<const std::uint16_t> smooth);
  ImageView<const std::uint16_t> level(int i) const { return levels_[static_cast<std::size_t>(i)]; }
  /// A copy of the levels.
  ImagePyramid clone() const;
  /// Replaces a level, to restore a saved pyramid.
  void set_level(int i, Image<std::uint16_t> pixels) { levels_[static_cast<std::size_t>(i)] = std::move(pixels); }

 private:
  Image<std::uint16_t> half_, quarter_, eighth_;
  std::array<Image<std::uint16_t>, kLevels> levels_;
};

/// Where a point of the previous image is in the current one, in pixels: its surroundings, deformed by `warp`, are
/// aligned with the eighth, within 32 px of the prediction, and from there with the quarter. std::nullopt where the
/// alignment with the quarter fails or its correlation is below `min_correlation`.
std::optional<Eigen::Vector2d> find_in_pyramid(const ImagePyramid& previous, const ImagePyramid& current,
                                               const Eigen::Vector2d& previous_px, const Eigen::Matrix2d& warp,
                                               const Eigen::Vector2d& predicted_px, double min_correlation);

}  // namespace spartan::internal
