// Disparity images and maps rendered in colour.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/reconstruction/v_disparity.h"

namespace spartan {

/// Renders disparities with Google's "turbo" colour map: large disparities (near) are red, small ones (far) blue,
/// unknown pixels (NaN) black. The colour range spans the 1st to the 99th percentile of the known disparities.
Image<Rgb8> colour_disparity(ImageView<const float> disparity);

/// Shaded relief lit from the north-west, obstacles tinted red and cavities blue; unknown cells are dark. `kind` as
/// LocalMap::kind. Each cell becomes `scale` x `scale` pixels.
Image<Rgb8> render_map(ImageView<const float> elevation_m, ImageView<const GroundClass> kind, double cell_m,
                       int scale = 4);

/// The left image with the ground tinted green, obstacles red and cavities blue; unknown pixels stay gray.
Image<Rgb8> render_classes(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> classes);

/// The v-disparity image (brighter: more pixels) with the ground profile of each strip, as it would appear straight
/// ahead, in yellow. For the middle strip the thresholds of an obstacle (red) and of a cavity (blue) are drawn as well.
Image<Rgb8> render_v_disparity(const VDisparity& v_disparity, const RectifiedStereo& geometry,
                               const VDisparityOptions& options);

/// The views that contributed to each cell, a colour for each set of them, the same for every eighth view. `views` as
/// MergedRange::views.
Image<Rgb8> render_view_coverage(ImageView<const std::uint8_t> views);

}  // namespace spartan
