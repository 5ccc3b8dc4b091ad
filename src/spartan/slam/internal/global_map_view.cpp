// Views of the global map: windows rendered from its submaps, its extent, samples.
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "spartan/slam/global_map.h"
#include "spartan/slam/internal/blank_map_view.h"

namespace spartan {
namespace {

constexpr int kTileSide = Tile::kSide;

}  // namespace

Status GlobalMap::render_aligned(const Submap& submap, MapView& view, std::vector<MapCell>& cells) {
  const LatticeOffset offset = *submap.lattice_offset(cell_m_);
  const LatticeWindow& w = view.window;
  const auto anchor_height = static_cast<float>(submap.world_from_submap.translation().z());
  const CellFusion fusion_parameters = fusion();
  for (int ty = Tile::of(w.north - w.height - offset.y); ty <= Tile::of(w.north - 1 - offset.y); ++ty) {
    for (int tx = Tile::of(w.west - offset.x); tx <= Tile::of(w.west + w.width - 1 - offset.x); ++tx) {
      const auto tile = load({submap.id, tx, ty});
      if (!tile) return failure(tile);
      if (*tile == nullptr) continue;
      for (int y = 0; y < kTileSide; ++y) {
        const int row = w.north - 1 - (ty * kTileSide + y + offset.y);
        if (row < 0 || row >= w.height) continue;
        for (int x = 0; x < kTileSide; ++x) {
          const int column = tx * kTileSide + x + offset.x - w.west;
          if (column < 0 || column >= w.width) continue;
          CellSurface surface = (*tile)->at(x, y).surface;
          if (!surface.observed()) continue;
          surface.shift_elevation(anchor_height);
          MapCell& cell = cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(w.width) +
                                static_cast<std::size_t>(column)];
          cell = fuse_observation(cell, surface, fusion_parameters);
        }
      }
    }
  }
  return {};
}

Status GlobalMap::render_resampled(const Submap& submap, MapView& view, std::vector<MapCell>& cells) {
  const LatticeWindow& w = view.window;
  const GeoTransform place = view.place();
  const Pose submap_from_world = submap.world_from_submap.inverse();
  const CellFusion fusion_parameters = fusion();
  for (int row = 0; row < w.height; ++row) {
    for (int column = 0; column < w.width; ++column) {
      const Eigen::Vector2d at = cell_centre(place, column, row);
      // Intersection of the vertical through the cell's centre with the submap's surface, by fixed-point iteration.
      double z = submap.world_from_submap.translation().z();
      CellSurface interpolated;
      bool complete = false;
      for (int round = 0; round < 3; ++round) {
        const Eigen::Vector3d p = submap_from_world * Eigen::Vector3d(at.x(), at.y(), z);
        const double u = p.x() / cell_m_ - 0.5, v = p.y() / cell_m_ - 0.5;
        const int x0 = static_cast<int>(std::floor(u)), y0 = static_cast<int>(std::floor(v));
        const double a = u - x0, b = v - y0;
        double elevation = 0, variance = 0, common = 0, logodds = 0;
        complete = true;
        for (int k = 0; k < 4 && complete; ++k) {
          const int x = x0 + k % 2, y = y0 + k / 2;
          const auto tile = load({submap.id, Tile::of(x), Tile::of(y)});
          if (!tile) return failure(tile);
          const CellSurface* s = *tile == nullptr
                                     ? nullptr
                                     : &(*tile)->at(x - kTileSide * Tile::of(x), y - kTileSide * Tile::of(y)).surface;
          complete = s != nullptr && s->observed();
          if (!complete) break;
          const double weight = (k % 2 == 1 ? a : 1 - a) * (k / 2 == 1 ? b : 1 - b);
          if (k == 0 || weight >= 0.25) interpolated = *s;
          elevation += weight * s->elevation_m;
          variance += weight * s->variance_m2;
          common += weight * s->common_variance_m2;
          logodds += weight * s->occupancy_logodds;
        }
        if (!complete) break;
        const Eigen::Vector3d point = submap.world_from_submap * Eigen::Vector3d(p.x(), p.y(), elevation);
        z = point.z();
        interpolated.shift_elevation(static_cast<float>(z) - interpolated.elevation_m);
        interpolated.variance_m2 = static_cast<float>(variance);
        interpolated.common_variance_m2 = static_cast<float>(common);
        interpolated.occupancy_logodds = static_cast<float>(logodds);
      }
      if (!complete) continue;
      MapCell& cell =
          cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(w.width) + static_cast<std::size_t>(column)];
      cell = fuse_observation(cell, interpolated, fusion_parameters);
    }
  }
  return {};
}

Result<MapView> GlobalMap::view(const LatticeWindow& window) {
  auto blank = internal::blank_map_view(window, cell_m_, kMostCells);
  if (!blank) return failure(blank);
  MapView view = std::move(*blank);
  std::vector<MapCell> cells(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height));
  for (const Submap& submap : submaps_) {
    const bool aligned = submap.lattice_offset(cell_m_).has_value();
    if (Status s = aligned ? render_aligned(submap, view, cells) : render_resampled(submap, view, cells); !s)
      return failure(s);
  }
  std::size_t i = 0;
  for (int row = 0; row < window.height; ++row) {
    for (int column = 0; column < window.width; ++column, ++i) {
      const CellSurface& s = cells[i].surface;
      if (!s.observed()) continue;
      view.elevation_m(column, row) = s.elevation_m;
      view.elevation_min_m(column, row) = s.lowest_m;
      view.elevation_max_m(column, row) = s.highest_m;
      view.variance_m2(column, row) = s.variance_m2;
      view.common_variance_m2(column, row) = s.common_variance_m2;
      view.count(column, row) = s.count;
      view.kind(column, row) = cells[i].kind();
      view.occupancy_logodds(column, row) = s.occupancy_logodds;
      view.stop(column, row) = s.stop;
    }
  }
  evict_tiles();
  return view;
}

LatticeWindow GlobalMap::window_of_tile(const TileKey& key) const {
  const auto submap =
      std::find_if(submaps_.begin(), submaps_.end(), [&](const Submap& s) { return s.id == key.submap; });
  double west = 1e300, east = -1e300, south = 1e300, north = -1e300;
  for (const auto& [x, y] : {std::pair{key.x, key.y}, {key.x + 1, key.y}, {key.x, key.y + 1}, {key.x + 1, key.y + 1}}) {
    const Eigen::Vector3d p =
        submap->world_from_submap * Eigen::Vector3d(x * kTileSide * cell_m_, y * kTileSide * cell_m_, 0);
    west = std::min(west, p.x());
    east = std::max(east, p.x());
    south = std::min(south, p.y());
    north = std::max(north, p.y());
  }
  // The tolerance keeps corners on the lattice in spite of rounding.
  const auto low = [&](double v) { return static_cast<int>(std::floor(v / cell_m_ + 1e-6)); };
  const auto high = [&](double v) { return static_cast<int>(std::ceil(v / cell_m_ - 1e-6)); };
  return {low(west), high(north), high(east) - low(west), high(north) - low(south)};
}

LatticeWindow GlobalMap::extent() const {
  LatticeWindow all;
  for (const auto& [key, slot] : tiles_) {
    const LatticeWindow tile = window_of_tile(key);
    all = all.cells() == 0 ? tile : window_around(all, tile);
  }
  return all;
}

std::vector<LatticeWindow> GlobalMap::pieces(int side) const {
  const LatticeWindow all = extent();
  std::set<std::pair<int, int>> touched;  // row and column of windows, from the corner of the extent
  for (const auto& [key, slot] : tiles_) {
    const LatticeWindow tile = window_of_tile(key);
    const int row = all.north - tile.north, column = tile.west - all.west;
    for (int r = row / side; r <= (row + tile.height - 1) / side; ++r) {
      for (int c = column / side; c <= (column + tile.width - 1) / side; ++c) touched.emplace(r, c);
    }
  }
  std::vector<LatticeWindow> windows;
  windows.reserve(touched.size());
  for (const auto& [r, c] : touched) {
    windows.push_back({all.west + c * side, all.north - r * side, std::min(side, all.width - c * side),
                       std::min(side, all.height - r * side)});
  }
  return windows;
}

Result<std::optional<MapSample>> GlobalMap::at(double x_m, double y_m) {
  const double u = x_m / cell_m_ - 0.5, v = y_m / cell_m_ - 0.5;
  const int x0 = static_cast<int>(std::floor(u)), y0 = static_cast<int>(std::floor(v));
  const auto around = view({x0, y0 + 2, 2, 2});
  if (!around) return failure(around);
  const double a = u - x0, b = v - y0;
  MapSample sample;
  for (int k = 0; k < 4; ++k) {
    const int c = k % 2, r = 1 - k / 2;
    if (!(around->count(c, r) > 0)) return std::nullopt;
    const double weight = (c == 1 ? a : 1 - a) * (r == 0 ? b : 1 - b);
    sample.elevation_m += weight * around->elevation_m(c, r);
    sample.variance_m2 += weight * around->variance_m2(c, r);
    sample.occupancy_logodds += weight * around->occupancy_logodds(c, r);
  }
  sample.kind = around->kind(a < 0.5 ? 0 : 1, b < 0.5 ? 1 : 0);
  return sample;
}

}  // namespace spartan
