// Maps as plots: elevation in colour with classes, scale and legend.
#pragma once

#include <string>

#include "spartan/figures/plot.h"
#include "spartan/reconstruction/local_map.h"

namespace spartan {

/// x of the world to the right, y up, in metres; colours as render_map().
/// Only the part between the outermost known cells is shown.
Plot map_plot(ImageView<const float> elevation_m, ImageView<const GroundClass> kind, const GeoTransform& place,
              const std::string& title);

}  // namespace spartan
