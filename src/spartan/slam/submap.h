// Submaps: pieces of the global map that hang on a pose, made of tiles of cells.
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

/// Gravity-aligned. Its cells hold x in [c s, (c + 1) s) and y in [r s, (r + 1) s) of the submap's own frame, s their
/// side; a newly made anchor is not turned and stands on the world's lattice, so that world and submap have the same
/// cells. Moving the anchor moves all of them and rewrites none.
struct LatticeStep {
  int x = 0, y = 0;
};
struct Submap {
  std::int32_t id = 0;
  Pose world_from_submap;

  /// Cells of the lattice from the world's to the submap's origin; none where the anchor is turned or off the lattice.
  std::optional<LatticeStep> step(double cell_m) const;
};

/// A stop that the map was made from: where it was put, and how well that is known (right perturbation).
struct MapStop {
  std::int32_t id = 0;
  Stamp stamp;
  UncertainPose world_from_body;
};

struct TileKey {
  std::int32_t submap = 0, x = 0, y = 0;
  friend auto operator<=>(const TileKey&, const TileKey&) = default;
};

/// A square of cells: those with x in [kSide · key.x, kSide · (key.x + 1)) of the submap's, and y alike.
struct Tile {
  static constexpr int kSide = 32;
  /// The tile that a cell of the submap lies in.
  static constexpr int of(int cell) { return cell >= 0 ? cell / kSide : -((kSide - 1 - cell) / kSide); }
  std::array<MapCell, kSide * kSide> cells;

  MapCell& at(int x, int y) { return cells[static_cast<std::size_t>(y * kSide + x)]; }
  const MapCell& at(int x, int y) const { return cells[static_cast<std::size_t>(y * kSide + x)]; }
  friend bool operator==(const Tile&, const Tile&) = default;
};

/// Only the cells that were seen. Versioned.
Bytes to_bytes(const Tile& tile);
/// Code `input` where the bytes are of another version or damaged; `what` names them.
Result<Tile> tile_from_bytes(const Bytes& bytes, const std::string& what);

}  // namespace spartan
