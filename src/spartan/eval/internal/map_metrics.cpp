#include "spartan/eval/internal/map_metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "spartan/numerics/connected_components.h"

namespace spartan::internal {
namespace {

// Ground truth within one cell of the map.
struct TrueCell {
  double mean_m = 0, lowest_m = 0, highest_m = 0;
  double over_m = 0, under_m = 0;  // maximum height above the local ground, maximum depth below the level
  double level_m = 0;              // mean
};

struct IndexRange {
  int from, to;
};

// Indices of the cells of width `cell` whose centres lie in [low, low + side).
IndexRange cells_within(double low, double side, double cell) {
  return {static_cast<int>(std::ceil(low / cell - 0.5 - 1e-9)),
          static_cast<int>(std::ceil((low + side) / cell - 0.5 - 1e-9))};
}

std::optional<TrueCell> true_cell(const EvaluatedMap& map, const TerrainTruth& truth, int column, int row) {
  const double side = map.place.cell_m, fine = truth.place.cell_m;
  const IndexRange x = cells_within(map.place.west_m + column * side - truth.place.west_m, side, fine);
  const IndexRange y = cells_within(truth.place.north_m - (map.place.north_m - row * side), side, fine);
  if (x.from < 0 || y.from < 0 || x.to > truth.surface_m.width() || y.to > truth.surface_m.height() || x.to <= x.from ||
      y.to <= y.from)
    return std::nullopt;
  TrueCell cell;
  cell.lowest_m = std::numeric_limits<double>::infinity();
  cell.highest_m = -cell.lowest_m;
  int count = 0;
  for (int j = y.from; j < y.to; ++j) {
    for (int i = x.from; i < x.to; ++i) {
      const double z = truth.surface_m(i, j);
      cell.mean_m += z;
      cell.lowest_m = std::min(cell.lowest_m, z);
      cell.highest_m = std::max(cell.highest_m, z);
      cell.over_m = std::max(cell.over_m, z - truth.ground_m(i, j));
      cell.under_m = std::max(cell.under_m, truth.level_m(i, j) - z);
      cell.level_m += truth.level_m(i, j);
      ++count;
    }
  }
  cell.mean_m /= count;
  cell.level_m /= count;
  return cell;
}

// Ground truth by cell of the map; kind 0 outside of the ground truth, else as EvaluatedMap::kind.
struct Labels {
  Image<std::uint8_t> kind;
  Image<float> size;  // height or depth
  Image<float> level;
};

// The connected regions of one kind that have a visible cell.
template <class Visible, class Marked>
std::vector<HazardScore> regions_of(const Labels& labels, std::uint8_t kind, const GeoTransform& place,
                                    double min_marked_fraction, ImageView<const float> lowest_seen,
                                    const Visible& visible, const Marked& marked) {
  const auto [w, h] = labels.kind.size();
  Image<std::uint8_t> mask(w, h);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) mask(x, y) = labels.kind(x, y) == kind ? 1 : 0;
  }
  std::vector<HazardScore> regions;
  for (const std::vector<PixelIndex>& cells : connected_components(mask)) {
    HazardScore region;
    for (const auto [x, y] : cells) {
      region.middle_m +=
          Eigen::Vector2d(place.west_m + (x + 0.5) * place.cell_m, place.north_m - (y + 0.5) * place.cell_m);
      region.height_m = std::max(region.height_m, static_cast<double>(labels.size(x, y)));
      if (!visible(x, y)) continue;
      ++region.visible_cells;
      region.marked_cells += marked(x, y) ? 1 : 0;
      const double depth = labels.level(x, y) - lowest_seen(x, y);
      if (depth > region.seen_depth_m) region.seen_depth_m = depth;
    }
    if (region.visible_cells == 0) continue;
    const auto count = static_cast<int>(cells.size());
    region.middle_m /= count;
    region.diameter_m = std::sqrt(4 / std::numbers::pi * count) * place.cell_m;
    region.found = region.marked_cells >= min_marked_fraction * region.visible_cells;
    regions.push_back(region);
  }
  return regions;
}

bool near_obstacle(const Labels& labels, int x, int y) {
  for (int j = y - 1; j <= y + 1; ++j) {
    for (int i = x - 1; i <= x + 1; ++i) {
      if (labels.kind.contains(i, j) && labels.kind(i, j) == 2) return true;
    }
  }
  return false;
}

}  // namespace

MapMetrics evaluate_map(const EvaluatedMap& map, const TerrainTruth& truth, const MapMetricsOptions& s) {
  const auto [w, h] = map.elevation_m.size();
  Labels labels{Image<std::uint8_t>(w, h), Image<float>(w, h), Image<float>(w, h)};
  MapMetrics m;
  double sum = 0, squares = 0;
  const auto in_range = [&](int x, int y) {
    const double range = std::hypot(map.place.west_m + (x + 0.5) * map.place.cell_m - s.viewpoint_m.x(),
                                    map.place.north_m - (y + 0.5) * map.place.cell_m - s.viewpoint_m.y());
    return range >= s.nearest_m && range < s.farthest_m;
  };
  const auto is_visible = [&](int x, int y) { return in_range(x, y) && map.visible(x, y) >= s.min_visible_pixels; };
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const auto cell = true_cell(map, truth, x, y);
      if (!cell) continue;
      labels.kind(x, y) = cell->over_m > s.obstacle_m ? 2 : cell->under_m > s.cavity_m ? 3 : 1;
      labels.size(x, y) = static_cast<float>(labels.kind(x, y) == 3 ? cell->under_m : cell->over_m);
      labels.level(x, y) = static_cast<float>(cell->level_m);
      const bool known = std::isfinite(map.elevation_m(x, y));
      if (is_visible(x, y)) {
        ++m.visible_cells;
        m.covered_cells += known ? 1 : 0;
      }
      if (!known || !in_range(x, y) || cell->highest_m - cell->lowest_m >= s.max_relief_m) continue;
      const double error = map.elevation_m(x, y) - cell->mean_m;
      sum += error;
      squares += error * error;
      ++m.elevation_cells;
    }
  }
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const auto kind = static_cast<std::size_t>(std::clamp(map.kind(x, y), 0.0F, 3.0F));
      if (labels.kind(x, y) == 0 || !in_range(x, y)) continue;
      if (is_visible(x, y)) ++m.confusion[labels.kind(x, y)][kind];
      if (kind == 0 || labels.kind(x, y) != 1) continue;
      ++m.free_cells;
      m.false_cells += kind == 2 && !near_obstacle(labels, x, y) ? 1 : 0;
    }
  }
  if (m.elevation_cells > 0) {
    m.bias_m = sum / m.elevation_cells;
    m.rms_m = std::sqrt(squares / m.elevation_cells);
  }
  m.obstacles = regions_of(labels, 2, map.place, s.min_marked_fraction, map.lowest_seen_m, is_visible,
                           [&](int x, int y) { return map.kind(x, y) == 2; });
  m.cavities = regions_of(labels, 3, map.place, s.min_marked_fraction, map.lowest_seen_m, is_visible,
                          [&](int x, int y) { return map.kind(x, y) == 3; });
  std::erase_if(m.cavities, [&](const HazardScore& cavity) { return cavity.seen_depth_m < s.cavity_m; });
  return m;
}

}  // namespace spartan::internal
