// How hard the ground is to drive over.
#pragma once

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/threads.h"

namespace spartan {

/// The rover that a map's costs are meant for.
struct RoverLimits {
  double wheel_radius_m = 0.1;
  double clearance_m = 0.1;
  double track_m = 0.6;
  double steepest_deg = 20;
  double highest_step_m = 0.08;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("wheel_radius_m", wheel_radius_m, "roughness of half of it cannot be driven on", between(0.01, 5));
    v.field("clearance_m", clearance_m, "obstacles as high as this cannot be driven over", between(0.01, 5));
    v.field("track_m", track_m, "left to right wheel: slopes are taken over half of it", between(0.05, 10));
    v.field("steepest_deg", steepest_deg, "slopes as steep as this cannot be driven on", between(1, 80));
    v.field("highest_step_m", highest_step_m, "steps as high as this cannot be climbed", between(0.005, 5));
  }
};

/// Layers of one size, as LocalMap's of the same names.
struct TerrainSurface {
  ImageView<const float> elevation_m, elevation_max_m, ground_m, kind;
  double cell_m = 0.05;
};

/// NaN where nothing was seen, and beside the step also where too little was seen around.
struct TerrainShape {
  Image<float> slope_rad, roughness_m;  ///< of the plane through a wheel's surroundings
  Image<float> step_m;                  ///< among the cell and its neighbours
  Image<float> cost;                    ///< 0 easy … 1 not to be driven on: the worst of its reasons
};
TerrainShape measure_shape(const TerrainSurface& surface, const RoverLimits& rover, const Workers& workers);

}  // namespace spartan
