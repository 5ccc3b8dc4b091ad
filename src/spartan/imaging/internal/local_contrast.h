// Local contrast (CLAHE): the local mode of the paper's sub-module "contrast".
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"

namespace spartan::internal {

/// Contrast-limited adaptive histogram equalisation (CLAHE; Zuiderveld, "Contrast Limited Adaptive Histogram
/// Equalization", Graphics Gems IV, 1994), as cv::createCLAHE. The image is divided into tiles × tiles rectangles
/// (mirrored beyond its right and lower border up to whole tiles). Each tile has a mapping by histogram equalisation,
/// in which counts above `clip_limit` times the mean count are clipped and spread over all levels. A pixel is mapped by
/// bilinear interpolation between the mappings of the four nearest tiles.
class LocalContrast {
 public:
  /// Throws where `tiles` < 1 or `clip_limit` < 1.
  LocalContrast(int tiles, double clip_limit);

  /// Both images have the same size. Integer arithmetic: the same bytes for any number of threads.
  void apply(ImageView<const std::uint8_t> image, ImageView<std::uint8_t> result, const ThreadPool& workers);

 private:
  std::uint8_t* mapping(int tile_x, int tile_y) {
    return mappings_.data() + (static_cast<std::ptrdiff_t>(tile_y) * tiles_ + tile_x) * 256;
  }
  void make_mapping(ImageView<const std::uint8_t> image, ImageSize tile, int tile_x, int tile_y);

  /// The two nearest tiles along one axis and the weight of the second one in 1/2048.
  struct TilePair {
    int first, second, weight;
  };
  TilePair tiles_around(int at, int tile) const;

  int tiles_;
  double clip_limit_;
  std::vector<TilePair> columns_;
  std::vector<std::uint8_t> mappings_;
};

}  // namespace spartan::internal
