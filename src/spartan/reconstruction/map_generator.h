// Map generation: points on the ground become a map with obstacles, cavities and costs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "spartan/core/options.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/disparity_merger.h"
#include "spartan/reconstruction/ground_surface.h"
#include "spartan/reconstruction/local_map.h"
#include "spartan/reconstruction/terrain_shape.h"
#include "spartan/reconstruction/v_disparity.h"

namespace spartan {

struct MapOptions {
  double extent_m = 8;
  double cell_m = 0.05;
  double obstacle_m = 0.1;
  double cavity_m = 0.1;
  double cut_share = 0.3;
  int fewest_points = 1;
  GroundSurfaceOptions ground;
  RoverLimits rover;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("extent_m", extent_m, "side of the map", between(0.5, 1000));
    v.field("cell_m", cell_m, "side of a cell", between(0.005, 10));
    v.field("obstacle_m", obstacle_m, "what stands so much over the ground is an obstacle", between(0.005, 5));
    v.field("cavity_m", cavity_m, "what lies so much below the ground is a cavity", between(0.005, 5));
    v.field("cut_share", cut_share,
            "what the upper edge of the view cuts off may be higher: an obstacle from this share of obstacle_m on",
            between(0.05, 1));
    v.field("fewest_points", fewest_points, "a cell with fewer stays unknown", between(1, 1000));
    v.group("ground", ground);
    v.group("rover", rover);
  }
};

/// A point seen.
struct SurfacePoint {
  Eigen::Vector3f in_body;
  float sigma_m = 0;      ///< along the ray
  Eigen::Vector3f along;  ///< the ray's direction, unit length, body frame
  GroundClass kind = GroundClass::unknown;
  bool cut = false;  ///< nothing was seen above it
};

std::vector<SurfacePoint> surface_points(const MergedRange& merged);

class MapGenerator {
 public:
  MapGenerator(const MapOptions& options, Workers workers) : options_(options), workers_(std::move(workers)) {}

  /// `map_from_body`: gravity-aligned; the map's middle is at its origin. Cells are at whole multiples of their side.
  LocalMap generate(std::span<const SurfacePoint> points, const Pose& map_from_body) const;

 private:
  MapOptions options_;
  Workers workers_;
};

}  // namespace spartan
