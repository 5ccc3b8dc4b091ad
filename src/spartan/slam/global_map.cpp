#include "spartan/slam/global_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "spartan/slam/internal/map_refinement.h"
#include "spartan/slam/internal/surface_grid.h"

namespace spartan {

using namespace internal;

namespace {

constexpr int kSide = Tile::kSide;

CellSurface surface_of(const LocalMap& local, int column, int row, const Matrix6d& world_covariance,
                       const SurfaceGrid& grid, const Eigen::Vector3d& body) {
  CellSurface s;
  s.elevation_m = local.elevation_m(column, row);
  s.lowest_m = local.elevation_min_m(column, row);
  s.highest_m = local.elevation_max_m(column, row);
  s.count = local.count(column, row);
  // Without a class only the elevation is fused.
  const GroundClass kind = local.kind(column, row);
  const float logodds = local.occupancy_logodds(column, row);
  if (kind != GroundClass::unknown && std::isfinite(logodds)) {
    s.occupancy_logodds = logodds;
    s.shape = static_cast<std::int16_t>(kind == GroundClass::obstacle ? 1 : kind == GroundClass::cavity ? -1 : 0);
    s.votes = 1;
  }
  Eigen::Vector2f slope = grid.slope(column, row);
  if (!slope.allFinite()) slope.setZero();
  const Eigen::Vector2d at = cell_centre(local.place, column, row);
  const Vector6d j =
      elevation_jacobian(slope.cast<double>(), {at.x() - body.x(), at.y() - body.y(), s.elevation_m - body.z()});
  s.variance_m2 = static_cast<float>(local.variance_m2(column, row) + j.dot(world_covariance * j));
  if (!local.common_variance_m2.empty()) s.common_variance_m2 = local.common_variance_m2(column, row);
  return s;
}

// Bounds of a stored map, so that cells count in int: 5e8 cells of 1 mm are 500 km.
constexpr double kLeastCell_m = 1e-3, kLargestCell_m = 1e3, kFarthestAnchor_cells = 5e8;

tl::unexpected<Error> damaged_store(const std::string& what) {
  return failure(ErrorCode::store_damaged, "the map is damaged: " + what, "",
                 "run again into a new folder to rebuild the map");
}

bool is_finite(const CellSurface& s) {
  return std::isfinite(s.elevation_m) && std::isfinite(s.variance_m2) && std::isfinite(s.common_variance_m2) &&
         std::isfinite(s.lowest_m) && std::isfinite(s.highest_m);
}

}  // namespace

MapBands MapView::bands(const Traversability& shape) const {
  MapBands bands{class_band(kind), {}};
  bands.list = {{"elevation_m", elevation_m.view()},
                {"elevation_min_m", elevation_min_m.view()},
                {"elevation_max_m", elevation_max_m.view()},
                {"variance_m2", variance_m2.view()},
                {"count", count.view()},
                {"slope_rad", shape.slope_rad.view()},
                {"roughness_m", shape.roughness_m.view()},
                {"step_m", shape.step_m.view()},
                {"class", std::as_const(bands.classes).view(), class_categories()},
                {"occupancy_logodds", occupancy_logodds.view()},
                {"cost", shape.cost.view()}};
  return bands;
}

Traversability MapView::shape(const MapOptions& options, const ThreadPool& workers) const {
  Image<std::uint8_t> free(window.width, window.height);
  for (int r = 0; r < window.height; ++r) {
    for (int c = 0; c < window.width; ++c) free(c, r) = kind(c, r) == GroundClass::ground ? 1 : 0;
  }
  const Image<float> ground_m = fit_ground(elevation_m, free, cell_m, options.ground, workers);
  return compute_traversability({elevation_m, elevation_max_m, ground_m, kind, cell_m}, options.rover, workers);
}

SurfaceGrid MapView::grid() const {
  SurfaceGrid grid;
  grid.window = window;
  grid.cell_m = cell_m;
  grid.elevation_m = elevation_m.clone();
  grid.variance_m2 = variance_m2.clone();  // of the noise: matching estimates common errors by itself
  grid.relief_m = elevation_max_m.clone();
  grid.occupancy = Image<float>(window.width, window.height, 0.0F);
  for (int r = 0; r < window.height; ++r) {
    for (int c = 0; c < window.width; ++c) {
      grid.relief_m(c, r) -= elevation_min_m(c, r);
      grid.variance_m2(c, r) -= common_variance_m2(c, r);
      if (count(c, r) > 0) grid.occupancy(c, r) = std::tanh(0.5F * occupancy_logodds(c, r));
    }
  }
  return grid;
}

GlobalMap::GlobalMap(const GlobalMapOptions& options, double cell_m) : options_(options), cell_m_(cell_m) {}

Result<GlobalMap> GlobalMap::create(const GlobalMapOptions& options, double cell_m) {
  if (Status valid = validate(options, "global map options"); !valid) return failure(valid);
  if (!(cell_m > 0) || !std::isfinite(cell_m)) {
    return failure(ErrorCode::configuration, fmt::format("the cell size is {} m and must be positive", cell_m));
  }
  return GlobalMap(options, cell_m);
}

Result<GlobalMap> GlobalMap::from_store(const GlobalMapOptions& options, double cell_m, TileStore& store) {
  auto created = create(options, cell_m);
  if (!created) return failure(created);
  GlobalMap& map = *created;
  map.store_ = &store;
  const auto cell = store.property("cell_m");
  if (!cell) return failure(cell);
  if (*cell && !(**cell >= kLeastCell_m && **cell <= kLargestCell_m)) {
    return damaged_store(fmt::format("the cell size is {} m", **cell));
  }
  if (*cell && **cell != cell_m) {
    return failure(ErrorCode::configuration,
                   fmt::format("the map has cells of {} m, the options say {} m", **cell, cell_m), "",
                   "set mapping.map.cell_m to the cell size of the map");
  }
  auto submaps = store.submaps();
  if (!submaps) return failure(submaps);
  auto stops = store.stops();
  if (!stops) return failure(stops);
  const auto index = store.index();
  if (!index) return failure(index);
  for (const Submap& submap : *submaps) {
    if (submap.world_from_submap.translation().cwiseAbs().maxCoeff() > kFarthestAnchor_cells * cell_m)
      return damaged_store(fmt::format("the anchor of submap {} is too far away", submap.id));
  }
  for (const TileStore::Entry& entry : *index) {
    const auto is_submap = [&](const Submap& submap) { return submap.id == entry.key.submap; };
    if (std::none_of(submaps->begin(), submaps->end(), is_submap))
      return damaged_store(fmt::format("table 'map_submaps' has no submap {}, but it has tiles", entry.key.submap));
  }
  map.submaps_ = std::move(*submaps);
  map.stops_ = std::move(*stops);
  map.submaps_stored_ = map.submaps_.size();
  map.stops_stored_ = map.stops_.size();
  for (const TileStore::Entry& entry : *index) map.tiles_[entry.key].revision = entry.revision;
  return created;
}

CellFusion GlobalMap::fusion() const {
  return {options_.gate_sigmas, options_.relief_sigma_ratio, options_.min_sigma_m * options_.min_sigma_m};
}

std::size_t GlobalMap::tiles_in_memory() const {
  return static_cast<std::size_t>(
      std::count_if(tiles_.begin(), tiles_.end(), [](const auto& slot) { return slot.second.tile != nullptr; }));
}

Result<Tile*> GlobalMap::load(const TileKey& key) {
  const auto found = tiles_.find(key);
  if (found == tiles_.end()) return nullptr;
  Slot& slot = found->second;
  slot.used = ++clock_;
  if (!slot.tile) {
    if (store_ == nullptr) throw std::logic_error("GlobalMap: a tile is in the store, but no store is open");
    auto tile = store_->read({key, slot.revision});
    if (!tile) return failure(tile);
    slot.tile = std::make_unique<Tile>(*tile);
  }
  return &*slot.tile;
}

Result<Tile*> GlobalMap::load_or_make(const TileKey& key) {
  const auto [slot, is_new] = tiles_.try_emplace(key);
  if (is_new) slot->second.tile = std::make_unique<Tile>();
  auto tile = load(key);
  if (!tile) return tile;
  slot->second.changed = true;
  slot->second.revision = static_cast<std::int64_t>(stops_.size());
  return tile;
}

void GlobalMap::evict_tiles() {
  const std::size_t max_tiles =
      std::max<std::size_t>(1, static_cast<std::size_t>(options_.memory_mb) * 1000000 / sizeof(Tile));
  std::vector<Slot*> clean;
  std::size_t in_memory = 0;
  for (auto& [key, slot] : tiles_) {
    if (!slot.tile) continue;
    ++in_memory;
    if (!slot.changed && slot.taken <= changes_stored_) clean.push_back(&slot);
  }
  std::sort(clean.begin(), clean.end(), [](const Slot* a, const Slot* b) { return a->used < b->used; });
  for (Slot* slot : clean) {
    if (in_memory <= max_tiles) return;
    slot->tile.reset();
    --in_memory;
  }
}

const Submap& GlobalMap::submap_for(const Eigen::Vector3d& place) {
  // Local maps are fused cell by cell, which needs a common lattice; a submap may have been moved off it.
  const auto suits = [&](const Submap& submap) {
    return (submap.world_from_submap.translation() - place).head<2>().norm() <= options_.submap_m &&
           submap.lattice_offset(cell_m_).has_value();
  };
  if (submaps_.empty() || !suits(submaps_.back())) {
    const Eigen::Vector3d anchor(std::round(place.x() / cell_m_) * cell_m_, std::round(place.y() / cell_m_) * cell_m_,
                                 place.z());
    const std::int32_t id = submaps_.empty() ? 0 : submaps_.back().id + 1;
    submaps_.push_back({id, Pose::from_translation(anchor)});
  }
  return submaps_.back();
}

Status GlobalMap::add(const LocalMap& local, const Stamp& stamp, const UncertainPose& world_from_body,
                      const Matrix6d& relative) {
  const Eigen::Vector3d body = world_from_body.pose.translation();
  const Submap submap = submap_for(body);  // a new one has no tiles that could fail to load
  const LatticeOffset offset = submap.lattice_offset(cell_m_).value();
  const auto minus_anchor_height = static_cast<float>(-submap.world_from_submap.translation().z());
  // Covariance of the right perturbation, transformed to world axes about the body.
  const Matrix6d rotation = [&] {
    Matrix6d m = Matrix6d::Zero();
    m.topLeftCorner<3, 3>() = m.bottomRightCorner<3, 3>() = world_from_body.pose.rotation_matrix();
    return m;
  }();
  const Matrix6d world_covariance = rotation * relative * rotation.transpose();
  const SurfaceGrid grid = grid_of(local);
  const LatticeWindow& window = grid.window;
  const CellFusion fusion_parameters = fusion();
  const int south_tile = Tile::of(window.north - window.height - offset.y),
            north_tile = Tile::of(window.north - 1 - offset.y), west_tile = Tile::of(window.west - offset.x),
            east_tile = Tile::of(window.west + window.width - 1 - offset.x);
  // Everything that can fail comes first, so that an error leaves the map unchanged.
  for (int ty = south_tile; ty <= north_tile; ++ty) {
    for (int tx = west_tile; tx <= east_tile; ++tx) {
      if (const auto loaded = load({submap.id, tx, ty}); !loaded) return failure(loaded);
    }
  }
  const std::int32_t stop = stops_.empty() ? 0 : stops_.back().id + 1;
  stops_.push_back({stop, stamp, world_from_body});
  for (int ty = south_tile; ty <= north_tile; ++ty) {
    for (int tx = west_tile; tx <= east_tile; ++tx) {
      Tile* tile = nullptr;
      for (int y = 0; y < kSide; ++y) {
        const int row = window.north - 1 - (ty * kSide + y + offset.y);
        if (row < 0 || row >= window.height) continue;
        for (int x = 0; x < kSide; ++x) {
          const int column = tx * kSide + x + offset.x - window.west;
          if (column < 0 || column >= window.width || !(local.count(column, row) > 0)) continue;
          CellSurface observation = surface_of(local, column, row, world_covariance, grid, body);
          if (!is_finite(observation)) continue;
          if (tile == nullptr) {
            auto loaded = load_or_make({submap.id, tx, ty});
            if (!loaded) return failure(loaded);
            tile = *loaded;
          }
          observation.shift_elevation(minus_anchor_height);
          observation.stop = stop;
          MapCell& cell = tile->at(x, y);
          cell = fuse_observation(cell, observation, fusion_parameters);
        }
      }
    }
  }
  return {};
}

std::size_t GlobalMap::shared_stops(const GlobalMap& other) const {
  const auto same = [](const MapStop& a, const MapStop& b) {
    const Pose &p = a.world_from_body.pose, &q = b.world_from_body.pose;
    return a.stamp == b.stamp && p.translation() == q.translation() && p.rotation().coeffs() == q.rotation().coeffs();
  };
  return static_cast<std::size_t>(std::count_if(other.stops_.begin(), other.stops_.end(), [&](const MapStop& stop) {
    return std::any_of(stops_.begin(), stops_.end(), [&](const MapStop& known) { return same(known, stop); });
  }));
}

Status GlobalMap::merge(GlobalMap& other) {
  if (const std::size_t shared = shared_stops(other); shared > 0) {
    if (shared == other.stops_.size()) return {};
    return failure(ErrorCode::usage,
                   fmt::format("{} of {} stops are in both maps and would count twice", shared, other.stops_.size()),
                   {}, "merge maps that share no stop, or of which one contains the other");
  }
  const std::int32_t first_submap = submaps_.empty() ? 0 : submaps_.back().id + 1,
                     first_stop = stops_.empty() ? 0 : stops_.back().id + 1;
  if (other.cell_m_ != cell_m_) return failure(ErrorCode::usage, "maps of different cell sizes cannot be merged");
  for (Submap submap : other.submaps_) {
    submap.id += first_submap;
    submaps_.push_back(submap);
  }
  for (MapStop stop : other.stops_) {
    stop.id += first_stop;
    stops_.push_back(stop);
  }
  for (auto& [key, slot] : other.tiles_) {
    const auto source = other.load(key);
    if (!source) return failure(source);
    auto target = load_or_make({key.submap + first_submap, key.x, key.y});
    if (!target) return failure(target);
    **target = **source;
    for (MapCell& cell : (*target)->cells) {
      if (cell.surface.observed()) cell.surface.stop += first_stop;
      if (cell.alternative.observed()) cell.alternative.stop += first_stop;
    }
  }
  return {};
}

Status GlobalMap::flush() {
  if (store_ == nullptr) return {};
  const MapChanges changes = take_changes();
  if (Status s = store_->write(changes); !s) return s;
  changes_stored(changes.number);
  return {};
}

MapChanges GlobalMap::take_changes() {
  MapChanges changes;
  changes.number = ++changes_taken_;
  if (submaps_stored_ == 0 && !submaps_.empty()) changes.cell_m = cell_m_;
  const auto rest = [](const auto& all, std::size_t& taken) {
    const auto first = all.begin() + static_cast<std::ptrdiff_t>(std::exchange(taken, all.size()));
    return std::decay_t<decltype(all)>(first, all.end());
  };
  changes.submaps = rest(submaps_, submaps_stored_);
  changes.stops = rest(stops_, stops_stored_);
  for (auto& [key, slot] : tiles_) {
    if (!slot.changed) continue;
    changes.tiles.emplace_back(TileEntry{key, slot.revision}, *slot.tile);
    slot.changed = false;
    slot.taken = changes.number;
  }
  return changes;
}

void GlobalMap::changes_stored(std::uint64_t number) {
  changes_stored_ = std::max(changes_stored_, number);
  evict_tiles();
}

Status GlobalMap::copy_to(TileStore& store) {
  if (Status s = store.write_property("cell_m", cell_m_); !s) return s;
  for (const Submap& submap : submaps_) {
    if (Status s = store.write(submap); !s) return s;
  }
  for (const MapStop& stop : stops_) {
    if (Status s = store.write(stop); !s) return s;
  }
  for (const auto& [key, slot] : tiles_) {
    const auto tile = load(key);
    if (!tile) return failure(tile);
    if (Status s = store.write({key, 1}, **tile); !s) return s;
    evict_tiles();
  }
  return {};
}

void GlobalMap::move_submap(std::int32_t id, const Pose& world_from_submap) {
  for (std::size_t i = 0; i < submaps_.size(); ++i) {
    if (submaps_[i].id != id) continue;
    submaps_[i].world_from_submap = world_from_submap;
    submaps_stored_ = std::min(submaps_stored_, i);
  }
}

}  // namespace spartan
