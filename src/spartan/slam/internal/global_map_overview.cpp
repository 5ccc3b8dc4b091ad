// The whole global map in larger cells.
#include <algorithm>
#include <cmath>

#include "spartan/slam/global_map.h"
#include "spartan/slam/internal/blank_map_view.h"

namespace spartan {
namespace {

int severity(GroundClass kind) {
  switch (kind) {
    case GroundClass::obstacle:
      return 3;
    case GroundClass::cavity:
      return 2;
    case GroundClass::ground:
      return 1;
    case GroundClass::unknown:
      break;
  }
  return 0;
}

// Of n values with the n-th one; NaN before the first.
void update_mean(float& mean, float value, float n) {
  mean = n == 1 ? value : mean + (value - mean) / n;
}

void add_to(MapView& view, Image<float>& cells, int column, int row, const MapCell& cell, double elevation_m) {
  const CellSurface& s = cell.surface;
  const auto z = static_cast<float>(elevation_m);
  const float n = ++cells(column, row);
  update_mean(view.elevation_m(column, row), z, n);
  update_mean(view.variance_m2(column, row), s.variance_m2, n);
  update_mean(view.common_variance_m2(column, row), s.common_variance_m2, n);
  // std::fmin and std::fmax leave out the NaN of cells without points.
  view.elevation_min_m(column, row) = std::fmin(view.elevation_min_m(column, row), z + s.lowest_m - s.elevation_m);
  view.elevation_max_m(column, row) = std::fmax(view.elevation_max_m(column, row), z + s.highest_m - s.elevation_m);
  float& logodds = view.occupancy_logodds(column, row);
  logodds = n == 1 ? s.occupancy_logodds : std::max(logodds, s.occupancy_logodds);
  view.count(column, row) += s.count;
  if (severity(cell.kind()) > severity(view.kind(column, row))) view.kind(column, row) = cell.kind();
  std::int32_t& stop = view.stop(column, row);
  stop = stop < 0 ? s.stop : std::min(stop, s.stop);
}

}  // namespace

Status GlobalMap::summarize(const Submap& submap, MapView& view, Image<float>& cells) {
  const auto end = tiles_.end();
  for (auto at = tiles_.lower_bound({submap.id, INT32_MIN, INT32_MIN}); at != end && at->first.submap == submap.id;
       ++at) {
    const auto tile = load(at->first);
    if (!tile) return failure(tile);
    for (int y = 0; y < Tile::kSide; ++y) {
      for (int x = 0; x < Tile::kSide; ++x) {
        const MapCell& cell = (*tile)->at(x, y);
        if (!cell.surface.observed()) continue;
        const Eigen::Vector3d p =
            submap.world_from_submap * Eigen::Vector3d((at->first.x * Tile::kSide + x + 0.5) * cell_m_,
                                                       (at->first.y * Tile::kSide + y + 0.5) * cell_m_,
                                                       static_cast<double>(cell.surface.elevation_m));
        const int column = static_cast<int>(std::floor(p.x() / view.cell_m)) - view.window.west;
        const int row = view.window.north - 1 - static_cast<int>(std::floor(p.y() / view.cell_m));
        // Tilted submaps may reach beyond the window of their tiles.
        if (column < 0 || row < 0 || column >= view.window.width || row >= view.window.height) continue;
        add_to(view, cells, column, row, cell, p.z());
      }
    }
  }
  return {};
}

int GlobalMap::overview_step(std::int64_t most_cells) const {
  const double excess = static_cast<double>(extent().cells()) / static_cast<double>(most_cells);
  return std::max(1, static_cast<int>(std::ceil(std::sqrt(excess))));
}

Result<MapView> GlobalMap::overview(int step) {
  const LatticeWindow all = extent();
  const GeoTransform place = all.place(cell_m_);
  const double cell_m = cell_m_ * step;
  const LatticeWindow window = window_between(place.west_m, place.north_m - all.height * cell_m_,
                                              place.west_m + all.width * cell_m_, place.north_m, cell_m);
  auto view = internal::blank_map_view(window, cell_m, kMostCells);
  if (!view) return view;
  Image<float> cells(window.width, window.height, 0.0F);
  for (const Submap& submap : submaps_) {
    if (Status s = summarize(submap, *view, cells); !s) return failure(s);
    evict_tiles();
  }
  return view;
}

}  // namespace spartan
