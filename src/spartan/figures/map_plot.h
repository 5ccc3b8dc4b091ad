// Maps as plots: elevation in colour with classes, scale and legend.
#pragma once

#include <string>

#include "spartan/figures/plot.h"
#include "spartan/reconstruction/local_map.h"

namespace spartan {

/// An image with a pixel for each cell as a plot in metres, with a scale bar; `name` of the layer. Images of more than
/// 1600 columns are reduced.
Plot ground_plot(Image<Rgb8> pixels, const GeoTransform& place, const std::string& title, const std::string& name);

/// A map: x of the world to the right, y up, in metres; colours as render_map().
/// Only the part between the outermost known cells is shown.
Plot map_plot(ImageView<const float> elevation_m, ImageView<const GroundClass> kind, const GeoTransform& place,
              const std::string& title);

}  // namespace spartan
