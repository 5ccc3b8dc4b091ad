// The global map: submaps of tiled cells, with a limited number of tiles in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "spartan/core/geotiff.h"
#include "spartan/reconstruction/local_map.h"
#include "spartan/reconstruction/map_generator.h"
#include "spartan/reconstruction/traversability.h"
#include "spartan/slam/lattice.h"
#include "spartan/slam/slam_options.h"
#include "spartan/slam/tile_store.h"

namespace spartan {

struct SurfaceGrid;

/// A rectangular part of the global map in the world frame. Unobserved cells are NaN (count and log-odds: 0).
struct MapView {
  LatticeWindow window;
  double cell_m = 0.05;
  Image<float> elevation_m, elevation_min_m, elevation_max_m, variance_m2, count, occupancy_logodds;
  Image<GroundClass> kind;
  Image<std::int32_t> stop;  ///< The first stop that observed the cell; −1: none.

  GeoTransform place() const { return window.place(cell_m); }
  /// The bands of a map file, with the names of docs/reference/files.md. `shape`: of this view.
  MapBands bands(const Traversability& shape) const;
  /// Slope, roughness, steps and costs. The ground surface is first fitted to the free cells.
  Traversability shape(const MapOptions& options, const ThreadPool& workers) const;
  SurfaceGrid grid() const;
};

/// The map at one position.
struct MapSample {
  double elevation_m = 0, variance_m2 = 0, occupancy_logodds = 0;
  GroundClass kind = GroundClass::unknown;
};

class GlobalMap {
 public:
  GlobalMap(const GlobalMapOptions& options, double cell_m);

  /// From now on tiles may be paged out to the store. Borrowed; it must contain this map or be empty.
  void page_to(TileStore* store) { store_ = store; }
  /// Opens the map of a store. Codes: the store's; `configuration` where its cell size differs.
  static Result<GlobalMap> from_store(const GlobalMapOptions& options, double cell_m, TileStore& store);

  /// Fuses a local map that was generated at `world_from_body`, cell by cell, and appends a stop with the next number.
  /// `relative`: covariance of the pose relative to this map (right perturbation). It inflates the variances of the
  /// observations by J relative Jᵀ, J the Jacobian of the elevation with respect to the pose.
  /// After an error of the store nothing has changed.
  Status add(const LocalMap& local, const Stamp& stamp, const UncertainPose& world_from_body, const Matrix6d& relative);
  /// Appends another map's submaps and stops. Overlapping submaps are fused in views.
  Status merge(GlobalMap& other);

  /// Renders a window. Codes: the store's; `usage` for more than kMostCells cells, which would need more than a
  /// gigabyte.
  Result<MapView> view(const LatticeWindow& window);
  static constexpr std::int64_t kMostCells = 8'000'000;
  /// Bounding window of all tiles; empty for an empty map.
  LatticeWindow extent() const;
  /// Disjoint windows of at most `side` by `side` cells that cover all tiles.
  std::vector<LatticeWindow> pieces(int side) const;
  /// Bilinear interpolation between cell centres; none where one of the four cells is unknown.
  Result<std::optional<MapSample>> at(double x_m, double y_m);

  /// Writes all changes to the store, inside its current transaction, and then evicts tiles beyond the memory limit.
  Status flush();
  /// Writes the whole map into an empty store.
  Status copy_to(TileStore& store);

  /// Moves the anchor of a submap, and thereby all its cells.
  void move_submap(std::int32_t id, const Pose& world_from_submap);

  double cell_m() const { return cell_m_; }
  const std::vector<Submap>& submaps() const { return submaps_; }
  const std::vector<MapStop>& stops() const { return stops_; }
  bool empty() const { return tiles_.empty(); }
  std::size_t tiles() const { return tiles_.size(); }
  std::size_t tiles_in_memory() const;

 private:
  struct Slot {
    std::int64_t revision = 0;   // 0: not yet in the store
    std::unique_ptr<Tile> tile;  // null: evicted
    bool changed = false;
    std::uint64_t used = 0;
  };
  static_assert(sizeof(Slot) < sizeof(Tile) / 100, "an evicted tile must need little memory");
  Result<Tile*> load(const TileKey& key);
  Result<Tile*> load_or_make(const TileKey& key);
  void evict_tiles();
  const Submap& submap_for(const Eigen::Vector3d& place);
  LatticeWindow window_of_tile(const TileKey& key) const;
  Status render_aligned(const Submap& submap, MapView& view, std::vector<MapCell>& cells);
  Status render_resampled(const Submap& submap, MapView& view, std::vector<MapCell>& cells);
  CellFusion fusion() const;

  GlobalMapOptions options_;
  double cell_m_;
  TileStore* store_ = nullptr;
  std::vector<Submap> submaps_;
  std::vector<MapStop> stops_;
  std::size_t submaps_stored_ = 0, stops_stored_ = 0;
  std::map<TileKey, Slot> tiles_;
  std::uint64_t clock_ = 0;
};

}  // namespace spartan
