// Errors of a terrain map against ground truth, by cell and by obstacle.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"

namespace spartan::internal {

/// Ground truth of the terrain, with cells smaller than the map's; row 0 in the north.
struct TerrainTruth {
  GeoTransform place;
  ImageView<const float> surface_m;  ///< elevation with rocks and cavities
  ImageView<const float> ground_m;   ///< elevation without rocks: the local ground
  ImageView<const float> level_m;    ///< elevation without rocks and cavities
};

/// The map under evaluation, in the same frame.
struct EvaluatedMap {
  GeoTransform place;
  ImageView<const float> elevation_m;      ///< NaN unknown
  ImageView<const float> kind;             ///< 0 unknown, 1 free, 2 obstacle, 3 cavity
  ImageView<const std::uint16_t> visible;  ///< pixels of the cell that both cameras of a pair see, maximum of all pairs
  ImageView<const float> lowest_seen_m;    ///< lowest true elevation of the cell that any pair sees; NaN none
};

struct MapMetricsOptions {
  Eigen::Vector2d viewpoint_m = Eigen::Vector2d::Zero();  ///< position of the camera, from which ranges are measured
  double nearest_m = 0, farthest_m = 4;                   ///< evaluated ranges, the far end excluded
  int min_visible_pixels = 4;                             ///< a cell with fewer visible pixels is not visible
  double max_relief_m = 0.05;        ///< elevations are evaluated in cells of less true relief (highest minus lowest)
  double obstacle_m = 0.1;           ///< minimum height of an obstacle above the local ground
  double cavity_m = 0.1;             ///< minimum depth of a cavity below the level
  double min_marked_fraction = 0.3;  ///< minimum marked fraction of the visible cells of a detected obstacle or cavity
};

/// A true obstacle or cavity and how the map shows it.
struct HazardScore {
  Eigen::Vector2d middle_m = Eigen::Vector2d::Zero();  ///< mean of its cells' centres
  double height_m = 0;                                 ///< largest height of an obstacle, depth of a cavity
  double diameter_m = 0;                               ///< of a disc of equal area
  int visible_cells = 0, marked_cells = 0;
  double seen_depth_m = 0;  ///< of a cavity: largest depth below the level that a camera pair sees
  bool found = false;       ///< detected: enough of its visible cells are marked
};

struct MapMetrics {
  int elevation_cells = 0;                   ///< number of cells with an evaluated elevation
  double bias_m = 0, rms_m = 0;              ///< of the elevation error, map minus truth
  int visible_cells = 0, covered_cells = 0;  ///< cells that could be mapped; of those with an elevation
  int free_cells = 0, false_cells = 0;  ///< observed and truly free; of those false positives: marked, no obstacle near
  std::vector<HazardScore> obstacles;   ///< with at least one visible cell
  std::vector<HazardScore> cavities;    ///< of which a pair sees at least MapMetricsOptions::cavity_m of depth
  std::array<std::array<int, 4>, 4> confusion{};  ///< [true kind][kind] of visible cells; row 0 stays 0

  double coverage() const { return visible_cells > 0 ? static_cast<double>(covered_cells) / visible_cells : 0; }
};

/// Evaluates a map. Cells that reach beyond the ground truth are ignored. "Near" an obstacle: at most one cell away.
MapMetrics evaluate_map(const EvaluatedMap& map, const TerrainTruth& truth, const MapMetricsOptions& scoring);

}  // namespace spartan::internal
