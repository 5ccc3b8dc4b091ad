// Cells, tiles and submaps of the global map, and their persistent storage.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"
#include "spartan/reconstruction/local_map.h"
#include "spartan/storage/database.h"

namespace spartan {

/// A surface in a cell, fused from the observations of one or more stops. Elevations are relative to the submap's
/// anchor.
struct CellSurface {
  float elevation_m = 0;
  float variance_m2 = 0;         ///< Variance of elevation_m.
  float common_variance_m2 = 0;  ///< The part of it that other observations have in common (LocalMap).
  float lowest_m = 0, highest_m = 0;
  float count = 0;              ///< Number of points; 0: not observed.
  float occupancy_logodds = 0;  ///< Log-odds of an obstacle or a cavity.
  std::int32_t stop = -1;       ///< The first stop that observed it.
  std::int16_t shape = 0;       ///< Observations as an obstacle minus observations as a cavity.
  std::uint16_t votes = 0;      ///< Number of observations of the class; 0: the class is unknown.

  bool observed() const { return count > 0; }
  void shift_elevation(float by_m) {
    elevation_m += by_m;
    lowest_m += by_m;
    highest_m += by_m;
  }
  friend bool operator==(const CellSurface&, const CellSurface&) = default;
};

struct MapCell {
  CellSurface surface;
  CellSurface alternative;  ///< Fused from observations that contradict the surface.

  /// Cells that were never observed, or only without a class, are unknown; free cells are ground.
  GroundClass kind() const;
  friend bool operator==(const MapCell&, const MapCell&) = default;
};

/// Parameters of the fusion of elevations; see GlobalMapOptions.
struct CellFusion {
  double gate_sigmas = 3;
  double relief_sigma_ratio = 0.15;  ///< Standard deviation of a cell's elevation over its relief.
  double least_variance_m2 = 4e-6;
};

/// Fuses one observation into a cell. If it passes the gate of the surface, both are fused, and the alternative loses a
/// vote. The weights are those of the best linear unbiased estimate of two values with the variances v and w whose
/// common parts are fully correlated, k = √(v_common w_common): (w − k) and (v − k) over their sum, at least 0. So
/// counting does not shrink the common part; the variance has a lower bound. Otherwise the surface does not change:
/// if the observation passes the gate of the alternative, it is fused into that; if not, the alternative loses a vote.
/// An alternative without votes is discarded. When its variance without the common part is below that of the surface
/// (where it was confirmed: at most that of the surface), the two are swapped. So a variance without common parts never
/// rises; repeated contradiction, or one that is known better, replaces the surface. Lowest and highest points are
/// running means, in which the newest observation has a weight of at least a tenth.
MapCell fuse_observation(const MapCell& cell, const CellSurface& observation, const CellFusion& fusion);

/// Translation in whole cells.
struct LatticeOffset {
  int x = 0, y = 0;
};

/// A gravity-aligned submap. Its cells cover x in [c s, (c + 1) s) and y in [r s, (r + 1) s) of the submap frame, s the
/// cell size. A new anchor has no rotation and lies on the world lattice, so that the cells of world and submap
/// coincide. Moving the anchor moves all cells without rewriting them.
struct Submap {
  std::int32_t id = 0;
  Pose world_from_submap;

  /// Offset in cells of the submap's origin from the world's; none where the anchor is rotated or off the lattice.
  std::optional<LatticeOffset> lattice_offset(double cell_m) const;
};

/// A stop that was fused into the map, with its corrected pose (covariance of the right perturbation).
struct MapStop {
  std::int32_t id = 0;
  Stamp stamp;
  UncertainPose world_from_body;
};

struct TileKey {
  std::int32_t submap = 0, x = 0, y = 0;
  friend auto operator<=>(const TileKey&, const TileKey&) = default;
};

/// A square of cells: columns [kSide · key.x, kSide · (key.x + 1)) of the submap, and rows alike.
struct Tile {
  static constexpr int kSide = 32;
  /// Index of the tile that contains a cell of the submap.
  static constexpr int of(int cell) { return cell >= 0 ? cell / kSide : -((kSide - 1 - cell) / kSide); }
  std::array<MapCell, kSide * kSide> cells;

  MapCell& at(int x, int y) { return cells[static_cast<std::size_t>(y * kSide + x)]; }
  const MapCell& at(int x, int y) const { return cells[static_cast<std::size_t>(y * kSide + x)]; }
  friend bool operator==(const Tile&, const Tile&) = default;
};

/// Serializes the observed cells only. Versioned.
Bytes to_bytes(const Tile& tile);
/// Code `input` where the bytes are of another version or damaged; `what` names them in the error.
Result<Tile> tile_from_bytes(const Bytes& bytes, const std::string& what);

/// One tile at one revision.
struct TileEntry {
  TileKey key;
  std::int64_t revision = 0;
};

/// What has changed in a global map since it was stored; a copy.
struct MapChanges {
  std::uint64_t number = 0;      ///< for GlobalMap::changes_stored()
  std::optional<double> cell_m;  ///< of a map that was never stored
  std::vector<Submap> submaps;   ///< new ones
  std::vector<MapStop> stops;    ///< new ones
  std::vector<std::pair<TileEntry, Tile>> tiles;
};

/// Writes take part in the current transaction of the database; its owner commits. Tables (all `map_…`):
/// map_tiles (submap, ix, iy, revision → checksum, cells), map_submaps (id → anchor), map_stops (id → stamp, pose,
/// covariance), map_properties (key → value). Only the newest revision of a tile is kept.
class TileStore {
 public:
  /// Opens the tables and creates missing ones. Borrows the database.
  static Result<TileStore> open(Database& db);
  /// Opens existing tables of a database that may be read-only.
  static Result<TileStore> open_existing(Database& db);

  using Entry = TileEntry;
  /// All tiles in the order of their keys, with their newest revisions.
  Result<std::vector<Entry>> index();
  Status write(const Entry& entry, const Tile& tile);
  /// Code `store_damaged`, naming file and tile, where the tile is missing or its checksum is wrong.
  Result<Tile> read(const Entry& entry);

  Status write(const Submap& submap);
  Result<std::vector<Submap>> submaps();
  Status write(const MapStop& stop);
  Result<std::vector<MapStop>> stops();
  Status write_property(const std::string& key, double value);
  Status write(const MapChanges& changes);
  Result<std::optional<double>> property(const std::string& key);

 private:
  explicit TileStore(Database& db) : db_(&db) {}
  Status prepare();
  Database* db_;
  std::optional<SqlStatement> insert_tile_, delete_older_, select_tile_;
};

/// One step of the schema migration: from version `to` − 1 to version `to`.
struct MapMigration {
  int to = 0;
  std::string sql;
};
/// Runs the missing steps, each in a transaction of its own that also sets `user_version`. Code `configuration` where
/// the file is newer than the last step.
Status migrate(Database& db, const std::vector<MapMigration>& steps);

}  // namespace spartan
