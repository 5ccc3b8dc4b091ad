// The global map: submaps of tiled cells, of which only some are in memory.
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
#include "spartan/reconstruction/terrain_shape.h"
#include "spartan/slam/lattice.h"
#include "spartan/slam/slam_options.h"
#include "spartan/slam/surface_grid.h"
#include "spartan/slam/tile_store.h"

namespace spartan {

/// A rectangle of the global map; elevations are the world's. NaN (count, class, log-odds: 0) where nothing was seen.
struct MapView {
  LatticeWindow window;
  double cell_m = 0.05;
  Image<float> elevation_m, elevation_min_m, elevation_max_m, variance_m2, count, kind, occupancy_logodds;
  Image<std::int32_t> stop;  ///< the first that saw it; −1 nowhere

  MapPlace place() const { return window.place(cell_m); }
  /// As files name them (docs/formats.md, "Maps"), with the shape that goes with them.
  std::vector<MapBand> bands(const TerrainShape& shape) const;
  /// The ground is fitted to the free cells first: costs are of what stands over it.
  TerrainShape shape(const MapOptions& options, const Workers& workers) const;
  SurfaceGrid grid() const;
};

/// The map at one place.
struct MapSample {
  double elevation_m = 0, variance_m2 = 0, occupancy_logodds = 0;
  int kind = 0;
};

class GlobalMap {
 public:
  GlobalMap(const GlobalMapOptions& options, double cell_m);

  /// From now on tiles may live in the store alone. Borrowed; must hold this map or be empty.
  void page_to(TileStore* store) { store_ = store; }
  /// A map as the store holds it. Codes as the store's; `configuration` where its cells have another size.
  static Result<GlobalMap> from_store(const GlobalMapOptions& options, double cell_m, TileStore& store);

  /// Fuses a local map, made at `stop`'s pose, cell on cell. `relative`: how well the map's place among what is there
  /// already is known (covariance of the pose's right perturbation); it makes the observations less certain where
  /// heights change with the pose. The stop gets the next number. After an error of the store nothing has changed.
  Status add(const LocalMap& local, const Stamp& stamp, const UncertainPose& world_from_body, const Matrix6d& relative);
  /// Appends another map's submaps and stops. Where they overlap, views fuse them.
  Status merge(GlobalMap& other);

  /// Codes: the store's; `usage` for more cells than kMostCells, which would take a gigabyte and more.
  Result<MapView> view(const LatticeWindow& window);
  static constexpr std::int64_t kMostCells = 8'000'000;
  /// Everything that was seen; empty where nothing was.
  LatticeWindow extent() const;
  /// The parts of it where there are tiles, in windows of at most `side` by `side` cells that do not overlap.
  std::vector<LatticeWindow> pieces(int side) const;
  /// Bilinear between the middles of the cells around; none where one of those is unknown.
  Result<std::optional<MapSample>> at(double x_m, double y_m);

  /// Writes what has changed to the store, inside the transaction it is in; then tiles beyond the memory may go.
  Status flush();
  /// All of it into an empty store.
  Status copy_to(TileStore& store);

  /// A submap's anchor moves, with all that hangs on it.
  void move_submap(std::int32_t id, const Pose& world_from_submap);

  double cell_m() const { return cell_m_; }
  const std::vector<Submap>& submaps() const { return submaps_; }
  const std::vector<MapStop>& stops() const { return stops_; }
  bool empty() const { return tiles_.empty(); }
  std::size_t tiles() const { return tiles_.size(); }
  std::size_t tiles_in_memory() const;

 private:
  struct Slot {
    std::int64_t revision = 0;   // 0: not in the store yet
    std::unique_ptr<Tile> tile;  // on its own: what is dropped is freed
    bool changed = false;
    std::uint64_t used = 0;
  };
  static_assert(sizeof(Slot) < sizeof(Tile) / 100, "a tile that is not in memory costs next to nothing");
  Result<Tile*> load(const TileKey& key);
  Result<Tile*> load_or_make(const TileKey& key);
  void drop_surplus();
  const Submap& submap_for(const Eigen::Vector3d& place);
  LatticeWindow window_of_tile(const TileKey& key) const;
  Status draw_in_step(const Submap& submap, MapView& view, std::vector<MapCell>& cells);
  Status draw_moved(const Submap& submap, MapView& view, std::vector<MapCell>& cells);
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
