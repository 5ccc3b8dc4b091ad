// Submaps: parts of the global map with an anchor pose each, stored as tiles of cells.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <optional>

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"
#include "spartan/slam/map_cell.h"

namespace spartan {

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

}  // namespace spartan
