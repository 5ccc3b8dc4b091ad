#include "spartan/reconstruction/local_map.h"

#include <cmath>
#include <utility>

namespace spartan {

GridCell cell_at(const GeoTransform& place, double x_m, double y_m) {
  return {static_cast<int>(std::floor((x_m - place.west_m) / place.cell_m)),
          static_cast<int>(std::floor((place.north_m - y_m) / place.cell_m))};
}

Eigen::Vector2d cell_centre(const GeoTransform& place, int column, int row) {
  return {place.west_m + (column + 0.5) * place.cell_m, place.north_m - (row + 0.5) * place.cell_m};
}

MapBands LocalMap::bands() const {
  MapBands bands{class_band(kind), {}};
  bands.list = {{"elevation_m", elevation_m.view()},
                {"elevation_min_m", elevation_min_m.view()},
                {"elevation_max_m", elevation_max_m.view()},
                {"variance_m2", variance_m2.view()},
                {"count", count.view()},
                {"slope_rad", slope_rad.view()},
                {"roughness_m", roughness_m.view()},
                {"step_m", step_m.view()},
                {"class", std::as_const(bands.classes).view(), class_categories()},
                {"occupancy_logodds", occupancy_logodds.view()},
                {"cost", cost.view()}};
  return bands;
}

}  // namespace spartan
