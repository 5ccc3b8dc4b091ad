// Contrast that follows the light of each part of the picture: the local mode of the sub-module "contrast".
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"

namespace spartan {

/// Contrast-limited adaptive histogram equalisation (Zuiderveld, "Contrast Limited Adaptive Histogram Equalization",
/// Graphics Gems IV, 1994). The image is cut into tiles × tiles rectangles (mirrored beyond its right and lower border
/// up to whole ones); the mapping of each makes its levels equally frequent, after counts over `clip` times the mean
/// are cut off and spread over all levels; a pixel is mapped by the four tiles around it, bilinearly.
class LocalContrast {
 public:
  /// Throws where `tiles` < 1 or `clip` < 1.
  LocalContrast(int tiles, double clip);

  /// Images of one size. Integers throughout: the same bytes for any number of threads.
  void apply(ImageView<const std::uint8_t> image, ImageView<std::uint8_t> result, const Workers& workers);

 private:
  std::uint8_t* mapping(int tile_x, int tile_y) {
    return mappings_.data() + (static_cast<std::ptrdiff_t>(tile_y) * tiles_ + tile_x) * 256;
  }
  void make_mapping(ImageView<const std::uint8_t> image, ImageSize tile, int tile_x, int tile_y);

  /// The two tiles around a place on one axis, and the share of the second one in 1/2048.
  struct Between {
    int first, second, share;
  };
  Between tiles_around(int at, int tile) const;

  int tiles_;
  double clip_;
  std::vector<Between> columns_;
  std::vector<std::uint8_t> mappings_;
};

}  // namespace spartan
