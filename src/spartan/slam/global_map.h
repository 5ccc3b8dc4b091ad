// The global map: submaps of tiled cells, with a limited number of tiles in memory; in a run or in a file of its own.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/reconstruction/local_map.h"
#include "spartan/reconstruction/map_generator.h"
#include "spartan/slam/slam_options.h"
#include "spartan/slam/tile_store.h"
#include "spartan/storage/database.h"

namespace spartan {

/// A rectangle of the world lattice of map cells, whose corners are integer multiples of the cell size, so that the
/// cells of all maps coincide. Column c holds x in [(west + c) s, (west + c + 1) s), row r holds y in
/// [(north − r − 1) s, (north − r) s), s the cell size: row 0 lies in the north, as in map files.
struct LatticeWindow {
  int west = 0, north = 0;
  int width = 0, height = 0;

  ImageSize size() const { return {width, height}; }
  std::int64_t cells() const { return std::int64_t{width} * height; }
  GeoTransform place(double cell_m) const { return {west * cell_m, north * cell_m, cell_m}; }
  friend bool operator==(const LatticeWindow&, const LatticeWindow&) = default;
};

/// All cells that intersect a rectangle of the world.
inline LatticeWindow window_between(double west_m, double south_m, double east_m, double north_m, double cell_m) {
  const int west = static_cast<int>(std::floor(west_m / cell_m)), east = static_cast<int>(std::ceil(east_m / cell_m)),
            south = static_cast<int>(std::floor(south_m / cell_m)),
            north = static_cast<int>(std::ceil(north_m / cell_m));
  return {west, north, east - west, north - south};
}

/// All cells within `reach_m` of a point, measured along x and y.
inline LatticeWindow window_around(double x_m, double y_m, double reach_m, double cell_m) {
  return window_between(x_m - reach_m, y_m - reach_m, x_m + reach_m, y_m + reach_m, cell_m);
}

/// The smallest window that contains both.
inline LatticeWindow window_around(const LatticeWindow& a, const LatticeWindow& b) {
  const int west = std::min(a.west, b.west), north = std::max(a.north, b.north),
            east = std::max(a.west + a.width, b.west + b.width),
            south = std::min(a.north - a.height, b.north - b.height);
  return {west, north, east - west, north - south};
}

/// The window of a map whose cells lie on the lattice.
inline LatticeWindow window_of(const GeoTransform& place, ImageSize size) {
  return {static_cast<int>(std::lround(place.west_m / place.cell_m)),
          static_cast<int>(std::lround(place.north_m / place.cell_m)), size.width, size.height};
}

namespace internal {
struct SurfaceGrid;
}

/// A rectangular part of the global map in the world frame. Unobserved cells are NaN (count and log-odds: 0).
struct MapView {
  LatticeWindow window;
  double cell_m = 0.05;
  Image<float> elevation_m, elevation_min_m, elevation_max_m, variance_m2, count, occupancy_logodds;
  Image<float> common_variance_m2;  ///< As of LocalMap.
  Image<GroundClass> kind;
  Image<std::int32_t> stop;  ///< The first stop that observed the cell; −1: none.

  GeoTransform place() const { return window.place(cell_m); }
  /// The bands of a map file, with the names of docs/reference/files.md. `shape`: of this view.
  MapBands bands(const Traversability& shape) const;
  /// Slope, roughness, steps and costs. The ground surface is first fitted to the free cells.
  Traversability shape(const MapOptions& options, const ThreadPool& workers) const;
  internal::SurfaceGrid grid() const;
};

/// The map at one position.
struct MapSample {
  double elevation_m = 0, variance_m2 = 0, occupancy_logodds = 0;
  GroundClass kind = GroundClass::unknown;
};

class GlobalMap {
 public:
  /// An empty map. Code `configuration` where an option is out of bounds or the cell size is not positive.
  static Result<GlobalMap> create(const GlobalMapOptions& options, double cell_m);

  /// From now on tiles may be paged out to the store. Borrowed; it must contain this map or be empty.
  void page_to(TileStore* store) { store_ = store; }
  /// Opens the map of a store. Codes: the store's; `configuration` where its cell size differs, and as
  /// create().
  static Result<GlobalMap> from_store(const GlobalMapOptions& options, double cell_m, TileStore& store);

  /// Fuses a local map that was generated at `world_from_body`, cell by cell, and appends a stop with the next number.
  /// `relative`: covariance of the pose relative to this map (right perturbation). It inflates the variances of the
  /// observations by J relative Jᵀ, J the Jacobian of the elevation with respect to the pose.
  /// After an error of the store nothing has changed.
  Status add(const LocalMap& local, const Stamp& stamp, const UncertainPose& world_from_body, const Matrix6d& relative);
  /// Appends another map's submaps and stops. Overlapping submaps are fused in views. A map whose stops are all in this
  /// one adds nothing: observations count once. Code `usage` where only some are, because cells do not tell them apart.
  Status merge(GlobalMap& other);
  /// How many stops of another map are in this one, with the same stamp and pose.
  std::size_t shared_stops(const GlobalMap& other) const;

  /// Renders a window. Codes: the store's; `usage` for more than kMostCells cells, which would need more than a
  /// gigabyte.
  Result<MapView> view(const LatticeWindow& window);
  static constexpr std::int64_t kMostCells = 8'000'000;
  /// The whole map in cells of `step` times the size, for maps that are too large to be rendered: the means of
  /// elevation and variance of the observed cells in each, their lowest and highest points, the sum of their counts,
  /// the largest log-odds and the most severe class (obstacle, cavity, free). Submaps that overlap are not fused.
  /// Codes: as view().
  Result<MapView> overview(int step);
  /// The smallest step of overview() with at most `most_cells` cells in the window of all tiles, 1 or more.
  int overview_step(std::int64_t most_cells) const;
  /// Bounding window of all tiles; empty for an empty map.
  LatticeWindow extent() const;
  /// Disjoint windows of at most `side` by `side` cells that cover all tiles.
  std::vector<LatticeWindow> pieces(int side) const;
  /// Bilinear interpolation between cell centres; none where one of the four cells is unknown.
  Result<std::optional<MapSample>> at(double x_m, double y_m);

  /// Writes all changes to the store, inside its current transaction, and then evicts tiles beyond the memory limit.
  Status flush();
  /// The same for a store that another thread writes: a copy of all changes since the last call. Their tiles are
  /// evicted only after changes_stored() with their number.
  MapChanges take_changes();
  void changes_stored(std::uint64_t number);
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
  GlobalMap(const GlobalMapOptions& options, double cell_m);
  struct Slot {
    std::int64_t revision = 0;   // number of stops in the map at its latest change, whenever it was stored
    std::unique_ptr<Tile> tile;  // null: evicted
    bool changed = false;
    std::uint64_t taken = 0;  // number of the changes with its latest content
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
  Status summarize(const Submap& submap, MapView& view, Image<float>& cells);
  CellFusion fusion() const;

  GlobalMapOptions options_;
  double cell_m_;
  TileStore* store_ = nullptr;
  std::vector<Submap> submaps_;
  std::vector<MapStop> stops_;
  std::size_t submaps_stored_ = 0, stops_stored_ = 0;
  std::map<TileKey, Slot> tiles_;
  std::uint64_t clock_ = 0;
  std::uint64_t changes_taken_ = 0, changes_stored_ = 0;
};

/// Statistics of the observed cells; all 0 where there are none.
struct MapStatistics {
  std::array<std::int64_t, 4> cells{};             ///< Number of cells by GroundClass.
  std::int64_t known = 0;                          ///< Number of observed cells.
  float min_elevation_m = 0, max_elevation_m = 0;  ///< Lowest and highest elevation.
  float median_variance_m2 = 0;  ///< Of the elevations; the upper of the two middle values of an even number.
};

/// Processes windows of at most `side` by `side` cells one after the other, in two passes. Codes: GlobalMap::view's.
Result<MapStatistics> map_statistics(GlobalMap& map, int side = 512);

/// An open map file and its map, whose tiles are read from it on demand.
class MapFile {
 public:
  /// Writes the whole map under a temporary name and renames it; an existing file is replaced. Code `output`.
  static Status save(GlobalMap& map, const std::string& path);
  /// Codes: `input` (missing, damaged, not a map), `configuration` (of a newer version of the program). Files of older
  /// versions are migrated first; opened read-only, they are rejected with code `configuration`.
  static Result<MapFile> open(const std::string& path, const GlobalMapOptions& options, Database::Mode mode);

  GlobalMap& map() { return *map_; }
  /// Writes all changes in one transaction.
  Status commit();

 private:
  explicit MapFile(std::unique_ptr<Database> db, std::unique_ptr<TileStore> store, std::unique_ptr<GlobalMap> map)
      : db_(std::move(db)), store_(std::move(store)), map_(std::move(map)) {}
  std::unique_ptr<Database> db_;
  std::unique_ptr<TileStore> store_;
  std::unique_ptr<GlobalMap> map_;
};

}  // namespace spartan
