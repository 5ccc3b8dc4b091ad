#include <array>
#include <cmath>
#include <cstdint>

#include "spartan/reconstruction/rendering.h"
#include "spartan/system/map_files.h"

namespace spartan {

Image<Rgb8> cell_colours(const MapView& view, const PointCloud& points) {
  if (points.empty())
    return render_map(view.elevation_m, view.kind, view.cell_m, elevation_colour_range(view.elevation_m, view.kind));
  Image<Rgb8> colours(view.window.width, view.window.height, kUnknownColour);
  Image<std::array<std::uint32_t, 4>> sums(view.window.width, view.window.height);
  const GeoTransform place = view.place();
  for (const ColouredPoint& point : points) {
    const double column = std::floor((static_cast<double>(point.position.x()) - place.west_m) / place.cell_m);
    const double row = std::floor((place.north_m - static_cast<double>(point.position.y())) / place.cell_m);
    if (!(column >= 0 && row >= 0 && column < view.window.width && row < view.window.height)) continue;
    std::array<std::uint32_t, 4>& sum = sums(static_cast<int>(column), static_cast<int>(row));
    const std::array<std::uint32_t, 4> added{point.colour.r, point.colour.g, point.colour.b, 1};
    for (std::size_t i = 0; i < 4; ++i) sum[i] += added[i];
  }
  for (int r = 0; r < view.window.height; ++r) {
    for (int c = 0; c < view.window.width; ++c) {
      const auto& [red, green, blue, n] = sums(c, r);
      if (n == 0) continue;
      colours(c, r) = {static_cast<std::uint8_t>(red / n), static_cast<std::uint8_t>(green / n),
                       static_cast<std::uint8_t>(blue / n)};
    }
  }
  return colours;
}

}  // namespace spartan
