// Traversability: slope, roughness, step height and traversal cost of every cell.
#pragma once

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/ground_class.h"

namespace spartan {

/// Limits of the rover for which traversal costs are computed.
struct RoverLimits {
  double wheel_radius_m = 0.1;  ///< m
  double clearance_m = 0.1;     ///< Ground clearance, m.
  double track_m = 0.6;         ///< Distance between the left and the right wheels, m.
  double max_slope_deg = 20;    ///< degrees
  double max_step_m = 0.08;     ///< m

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("wheel_radius_m", wheel_radius_m,
            "Wheel radius of the rover in metres; a roughness of half of it has cost 1, and raising it lowers the cost "
            "of rough ground.",
            between(0.01, 5));
    v.field(
        "clearance_m", clearance_m,
        "Ground clearance of the rover in metres; an object that high has cost 1, and raising it lowers the cost of "
        "rocks.",
        between(0.01, 5));
    v.field("track_m", track_m,
            "Distance between the left and the right wheels in metres; slope and roughness are fitted over a square of "
            "half of it, so raising it smooths them.",
            between(0.05, 10));
    v.renamed("steepest_deg", "max_slope_deg");
    v.field("max_slope_deg", max_slope_deg,
            "Steepest traversable slope in degrees; a slope that steep has cost 1, and raising it lowers the cost of "
            "slopes.",
            between(1, 80));
    v.renamed("highest_step_m", "max_step_m");
    v.field(
        "max_step_m", max_step_m,
        "Highest traversable step between neighbouring cells in metres; a step that high has cost 1, and raising it "
        "lowers the cost of steps.",
        between(0.005, 5));
  }
};

/// Input layers of one size, as LocalMap's of the same names.
struct TerrainSurface {
  ImageView<const float> elevation_m, elevation_max_m, ground_m;
  ImageView<const GroundClass> kind;
  double cell_m = 0.05;
};

/// NaN in unobserved cells; all but the step are also NaN where too few neighbours are observed.
struct Traversability {
  Image<float> slope_rad, roughness_m;  ///< Slope and residual RMS of the plane fitted to the neighbourhood.
  Image<float> step_m;                  ///< Elevation range of the cell and its eight neighbours.
  Image<float> cost;                    ///< 0 (easy) … 1 (not traversable): the largest of its terms.
};
Traversability compute_traversability(const TerrainSurface& surface, const RoverLimits& rover,
                                      const ThreadPool& workers);

}  // namespace spartan
