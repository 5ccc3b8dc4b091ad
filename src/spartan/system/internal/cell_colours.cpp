#include "spartan/system/internal/cell_colours.h"

#include <cmath>

#include "spartan/reconstruction/rendering.h"

namespace spartan::internal {

void CellColours::add(const PointCloud& points) {
  for (const ColouredPoint& point : points) {
    const double column = std::floor((static_cast<double>(point.position.x()) - place_.west_m) / place_.cell_m);
    const double row = std::floor((place_.north_m - static_cast<double>(point.position.y())) / place_.cell_m);
    if (!(column >= 0 && row >= 0 && column < sums_.width() && row < sums_.height())) continue;
    std::array<std::uint32_t, 4>& sum = sums_(static_cast<int>(column), static_cast<int>(row));
    const std::array<std::uint32_t, 4> added{point.colour.r, point.colour.g, point.colour.b, 1};
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += added[i];
    any_ = true;
  }
}

Image<Rgb8> CellColours::image(const MapView& view) const {
  if (!any_)
    return render_map(view.elevation_m, view.kind, view.cell_m, elevation_colour_range(view.elevation_m, view.kind));
  Image<Rgb8> colours(sums_.width(), sums_.height(), kUnknownColour);
  for (int r = 0; r < sums_.height(); ++r) {
    for (int c = 0; c < sums_.width(); ++c) {
      const auto& [red, green, blue, n] = sums_(c, r);
      if (n == 0) continue;
      colours(c, r) = {static_cast<std::uint8_t>(red / n), static_cast<std::uint8_t>(green / n),
                       static_cast<std::uint8_t>(blue / n)};
    }
  }
  return colours;
}

}  // namespace spartan::internal
