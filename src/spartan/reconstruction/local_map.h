// The local map: a 2.5D grid of the terrain around one stop.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"

namespace spartan {

/// Class of a pixel or a map cell. A map cell of class `ground` is free; a cavity is a negative obstacle. The values
/// are those of the band "class" of map files (docs/reference/files.md).
enum class GroundClass : std::uint8_t { unknown = 0, ground = 1, obstacle = 2, cavity = 3 };

/// The band "class" of a map file.
Image<float> class_band(ImageView<const GroundClass> classes);
/// Names and colours of its values.
std::vector<MapCategory> class_categories();

/// A cell of a map: row 0 lies in the north (largest y), column 0 in the west (smallest x).
struct GridCell {
  int column = 0, row = 0;
};
GridCell cell_at(const GeoTransform& place, double x_m, double y_m);
Eigen::Vector2d cell_centre(const GeoTransform& place, int column, int row);

/// An 8-connected component of obstacle cells.
struct Obstacle {
  Eigen::Vector2d middle_m = Eigen::Vector2d::Zero();  ///< Centre of the bounding box, map frame.
  double width_m = 0, length_m = 0;                    ///< Extent of the bounding box along x and y.
  double height_m = 0;                                 ///< Highest point above the ground surface.
  int cells = 0;
};

/// The bands of a map file in their order. They borrow from the map and from this struct.
struct MapBands {
  Image<float> classes;  ///< The classes as numbers.
  std::vector<MapBand> list;
};

/// Elevation, classes and traversability in a gravity-aligned map frame (z up). Unobserved cells are NaN unless stated
/// otherwise.
struct LocalMap {
  Pose map_from_body;
  GeoTransform place;
  Image<float> elevation_m, elevation_min_m, elevation_max_m;
  Image<float> variance_m2;  ///< Variance of elevation_m.
  /// The part of variance_m2 by errors of the calibration, which cells and further maps have in common. Empty: 0.
  Image<float> common_variance_m2;
  Image<float> count;     ///< Number of points; 0 where unobserved.
  Image<float> ground_m;  ///< Elevation of the ground surface beneath obstacles and above cavities; NaN where too few
                          ///< cells are around.
  Image<float> slope_rad, roughness_m, step_m;
  Image<GroundClass> kind;         ///< Unobserved cells and cells without ground_m are unknown, free cells are ground.
  Image<float> occupancy_logodds;  ///< Log-odds of an obstacle or a cavity; 0 where the class is unknown.
  Image<float> cost;               ///< Traversal cost, 0 (easy) … 1 (not traversable).
  std::vector<Obstacle> obstacles;

  ImageSize size() const { return elevation_m.size(); }
  /// The bands of a map file, with the names of docs/reference/files.md.
  MapBands bands() const;
};

}  // namespace spartan
