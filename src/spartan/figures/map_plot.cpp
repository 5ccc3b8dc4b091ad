#include "spartan/figures/map_plot.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/figures/html.h"
#include "spartan/reconstruction/rendering.h"

namespace spartan {
namespace {

constexpr int kMostPixels = 1600, kWantedPixels = 640;  // of the image

// The cells between the outermost known ones; all where none is known.
struct Part {
  int x = 0, y = 0, width = 0, height = 0;
};
Part known_part(ImageView<const float> elevation_m) {
  int left = elevation_m.width(), right = -1, top = elevation_m.height(), bottom = -1;
  for (int y = 0; y < elevation_m.height(); ++y) {
    for (int x = 0; x < elevation_m.width(); ++x) {
      if (!std::isfinite(elevation_m(x, y))) continue;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = std::max(bottom, y);
    }
  }
  if (right < 0) return {0, 0, elevation_m.width(), elevation_m.height()};
  return {left, top, right - left + 1, bottom - top + 1};
}

}  // namespace

Plot ground_plot(Image<Rgb8> pixels, const GeoTransform& place, const std::string& title, const std::string& name) {
  const int block = std::max(1, (pixels.width() + kMostPixels - 1) / kMostPixels);
  if (block > 1) pixels = shrunk(pixels.view(), kMostPixels);  // without the blocks that are not complete
  const double width_m = pixels.width() * block * place.cell_m, height_m = pixels.height() * block * place.cell_m;
  const int scale = std::max(1, kWantedPixels / std::max({1, pixels.width(), pixels.height()}));
  Plot plot;
  plot.title = title;
  plot.x_label = "x, m";
  plot.y_label = "y, m";
  plot.equal_axes = true;
  plot.width_px = kPlotMargin_px + scale * pixels.width();
  plot.height_px = kPlotHeading_px + scale * pixels.height();
  plot.image = PlotImage{
      name, std::move(pixels), {place.west_m, place.west_m + width_m}, {place.north_m - height_m, place.north_m}};
  return plot;
}

Plot map_plot(ImageView<const float> elevation_m, ImageView<const GroundClass> kind, const GeoTransform& place,
              const std::string& title) {
  const Part part = known_part(elevation_m);
  const auto elevations = elevation_m.crop(part.x, part.y, part.width, part.height);
  const auto kinds = kind.crop(part.x, part.y, part.width, part.height);
  const Range range = elevation_colour_range(elevations, kinds);
  const GeoTransform corner{place.west_m + part.x * place.cell_m, place.north_m - part.y * place.cell_m, place.cell_m};
  Plot plot = ground_plot(render_map(elevations, kinds, place.cell_m, range), corner, title, "elevation");
  plot.colour_bar = ColourBar{"elevation, m", range, elevation_colour};
  plot.keys = {{"obstacle", kObstacleColour}, {"cavity", kCavityColour}, {"unknown", kUnknownColour}};
  return plot;
}

}  // namespace spartan
