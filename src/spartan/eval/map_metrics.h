// How right a map of the ground is, cell by cell and obstacle by obstacle.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "spartan/core/geotiff.h"
#include "spartan/core/image.h"

namespace spartan {

/// The ground as it is, finer than the map; row 0 in the north.
struct TrueGround {
  MapPlace place;
  ImageView<const float> surface_m;  ///< with rocks and cavities
  ImageView<const float> ground_m;   ///< without rocks: the local ground
  ImageView<const float> level_m;    ///< without rocks and cavities
};

/// The map that is judged, in the same frame.
struct JudgedMap {
  MapPlace place;
  ImageView<const float> elevation_m;      ///< NaN unknown
  ImageView<const float> kind;             ///< 0 unknown, 1 free, 2 obstacle, 3 cavity
  ImageView<const std::uint16_t> visible;  ///< pixels that both eyes of one pair see there, the most of any pair
  ImageView<const float> lowest_seen_m;    ///< of the true surface that any pair sees there; NaN none
};

struct MapScoring {
  Eigen::Vector2d eye_m = Eigen::Vector2d::Zero();  ///< ranges are measured from here
  double nearest_m = 0, farthest_m = 4;
  int fewest_pixels = 4;     ///< a cell with fewer is not visible
  double flat_m = 0.05;      ///< elevation is judged where the true relief of the cell is less
  double obstacle_m = 0.1;   ///< over the local ground
  double cavity_m = 0.1;     ///< below the level
  double found_share = 0.3;  ///< of an obstacle's visible cells that must be marked
};

/// A true obstacle or cavity with what was made of it.
struct JudgedThing {
  Eigen::Vector2d middle_m = Eigen::Vector2d::Zero();  ///< of its cells
  double height_m = 0;                                 ///< or depth; the largest
  double diameter_m = 0;                               ///< of the disc of its area
  int visible_cells = 0, marked_cells = 0;
  double seen_depth_m = 0;  ///< of a cavity: how far below the level it is seen
  bool found = false;
};

struct MapMetrics {
  int judged_cells = 0;  ///< for elevation
  double bias_m = 0, rms_m = 0;
  int visible_cells = 0, covered_cells = 0;
  int free_cells = 0, false_cells = 0;  ///< observed and truly free; of those marked though no true obstacle is near
  std::vector<JudgedThing> obstacles;   ///< with a visible cell
  std::vector<JudgedThing> cavities;    ///< seen at least MapScoring::cavity_m deep
  std::array<std::array<int, 4>, 4> confusion{};  ///< [true kind][kind] of visible cells; true 0: none inside the truth

  double coverage() const { return visible_cells > 0 ? static_cast<double>(covered_cells) / visible_cells : 0; }
  double false_share() const { return free_cells > 0 ? static_cast<double>(false_cells) / free_cells : 0; }
};

/// Cells outside the truth are left out. "Near" an obstacle: not more than one cell away.
MapMetrics judge_map(const JudgedMap& map, const TrueGround& truth, const MapScoring& scoring);

}  // namespace spartan
