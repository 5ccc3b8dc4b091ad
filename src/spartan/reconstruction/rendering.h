// Disparity images and maps rendered in colour.
#pragma once

#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/reconstruction/v_disparity.h"

namespace spartan {

/// Google's "turbo" colour map: blue over green to red; `value` 0 … 1.
Rgb8 disparity_colour(double value);
/// The 1st to the 99th percentile of the known disparities, px: what the colours of colour_disparity() span.
Range disparity_colour_range(ImageView<const float> disparity);
/// Renders disparities: large ones (near) are red, small ones (far) blue, unknown pixels (NaN) black.
Image<Rgb8> colour_disparity(ImageView<const float> disparity);

/// Dark blue over gray to yellow; `value` 0 … 1. Even steps of lightness, also for colour-blind readers; close to
/// "cividis" (Nuñez, Anderton & Renslow, PLOS ONE 2018). Red and blue remain free for obstacles and cavities.
Rgb8 elevation_colour(double value);
inline constexpr Rgb8 kObstacleColour{220, 50, 40}, kCavityColour{40, 90, 230}, kUnknownColour{236, 233, 228};
inline constexpr Rgb8 kGroundColour{70, 190, 80}, kGroundProfileColour{235, 205, 40};
/// The 2nd to the 98th percentile of the elevations of the ground (of all cells where there is none), at least 5 cm:
/// what the colours of a map span.
Range elevation_colour_range(ImageView<const float> elevation_m, ImageView<const GroundClass> kind);
/// Elevations in colours that span `range_m`, lit from the upper left; obstacles are red, cavities blue, unknown cells
/// light gray. A pixel for each cell. `kind` as LocalMap::kind.
Image<Rgb8> render_map(ImageView<const float> elevation_m, ImageView<const GroundClass> kind, double cell_m,
                       const Range& range_m);

/// The left image with the ground tinted green, obstacles red and cavities blue; unknown pixels stay gray.
Image<Rgb8> render_classes(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> classes);

/// The v-disparity image (brighter: more pixels) with the ground profile of each strip, as it would appear straight
/// ahead, in yellow. For the middle strip the thresholds of an obstacle (red) and of a cavity (blue) are drawn as well.
Image<Rgb8> render_v_disparity(const VDisparity& v_disparity, const RectifiedStereo& geometry,
                               const VDisparityOptions& options);

/// The colour of one view in render_view_coverage(), the same for every eighth view.
Rgb8 view_colour(std::size_t view);
/// The views that contributed to each cell; the colour of several views is the mean of theirs. `views` as
/// MergedRange::views.
Image<Rgb8> render_view_coverage(ImageView<const std::uint8_t> views);

}  // namespace spartan
