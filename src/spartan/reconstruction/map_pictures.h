// Maps and what leads to them as pictures for people.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/reconstruction/v_disparity.h"

namespace spartan {

/// The relief lit from the north-west, obstacles tinted red and cavities blue; unknown cells are dark. `kind` as
/// LocalMap::kind. Each cell becomes `scale` x `scale` pixels.
Image<Rgb8> draw_map(ImageView<const float> elevation_m, ImageView<const float> kind, double cell_m, int scale = 4);

/// The left image with the ground tinted green, obstacles red, cavities blue; unknown pixels stay gray.
Image<Rgb8> draw_classes(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> classes);

/// The v-disparity image (brighter: more pixels) with the profile of each strip as it would lie straight ahead, yellow,
/// and of the middle one what is counted as an obstacle (from the red line up) and as a cavity (from the blue one
/// down).
Image<Rgb8> draw_v_disparity(const VDisparity& seen, const RectifiedStereo& geometry, const VDisparityOptions& options);

/// Which views took part: a colour for each set of them, the same for every eighth view. `views` as MergedRange::views.
Image<Rgb8> draw_coverage(ImageView<const std::uint8_t> views);

}  // namespace spartan
