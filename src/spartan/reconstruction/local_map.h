// The ground around one position of the rover as a grid.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "spartan/core/geotiff.h"
#include "spartan/core/image.h"
#include "spartan/core/pose.h"

namespace spartan {

/// Cells of a map: row 0 in the north (largest y), column 0 in the west (smallest x).
struct GridCell {
  int column = 0, row = 0;
};
GridCell cell_at(const MapPlace& place, double x_m, double y_m);
Eigen::Vector2d middle_of(const MapPlace& place, int column, int row);

/// Something that stands up from the ground: cells that touch.
struct Obstacle {
  Eigen::Vector2d middle_m = Eigen::Vector2d::Zero();  ///< map frame
  double width_m = 0, length_m = 0;                    ///< along x and y
  double height_m = 0;                                 ///< over the ground
  int cells = 0;
};

/// Gravity-aligned (z up), with the heading of the attitude that it was made with. NaN where nothing was seen.
struct LocalMap {
  Pose map_from_body;
  MapPlace place;
  Image<float> elevation_m, elevation_min_m, elevation_max_m;
  Image<float> variance_m2;  ///< of elevation_m
  Image<float> count;        ///< points; 0 where nothing was seen
  Image<float> ground_m;     ///< the ground without what stands on it; NaN where too few cells lie around
  Image<float> slope_rad, roughness_m, step_m;
  Image<float> kind;               ///< 0 unknown (also where ground_m is NaN), 1 free, 2 obstacle, 3 cavity
  Image<float> occupancy_logodds;  ///< of an obstacle or a cavity; 0 where the class is unknown
  Image<float> cost;               ///< 0 easy … 1 not to be driven on
  std::vector<Obstacle> obstacles;

  ImageSize size() const { return elevation_m.size(); }
  /// As files name them (docs/formats.md, "Maps").
  std::vector<MapBand> bands() const;
};

}  // namespace spartan
