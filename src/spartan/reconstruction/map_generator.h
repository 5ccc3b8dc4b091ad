// Map generation: a point cloud becomes a local map with obstacles, cavities and traversal costs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "spartan/core/options.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/disparity_merger.h"
#include "spartan/reconstruction/ground_surface.h"
#include "spartan/reconstruction/local_map.h"
#include "spartan/reconstruction/traversability.h"
#include "spartan/reconstruction/v_disparity.h"

namespace spartan {

struct MapOptions {
  double extent_m = 8;      ///< Side of the square map, m.
  double cell_m = 0.05;     ///< Side of a cell, m.
  double obstacle_m = 0.1;  ///< Minimum height of an obstacle above the ground surface, m.
  double cavity_m = 0.1;    ///< Minimum depth of a cavity (negative obstacle) below the ground surface, m.
  double truncated_obstacle_factor =
      0.3;             ///< Factor on obstacle_m where the upper edge of the view truncates an object.
  int min_points = 1;  ///< Minimum number of points of an observed cell.
  GroundSurfaceOptions ground;
  RoverLimits rover;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("extent_m", extent_m,
            "Side of the square local map in metres; raising it covers terrain farther from the rover and costs memory "
            "and time.",
            between(0.5, 1000));
    v.field("cell_m", cell_m,
            "Side of a map cell in metres; raising it averages more points per cell and loses small obstacles.",
            between(0.005, 10));
    v.field("obstacle_m", obstacle_m,
            "Minimum height of an obstacle above the ground surface in metres; raising it reports fewer, higher "
            "obstacles.",
            between(0.005, 5));
    v.field("cavity_m", cavity_m,
            "Minimum depth of a cavity (negative obstacle) below the ground surface in metres; raising it reports "
            "fewer, deeper cavities.",
            between(0.005, 5));
    v.renamed("cut_share", "truncated_obstacle_factor");
    v.field(
        "truncated_obstacle_factor", truncated_obstacle_factor,
        "Factor on obstacle_m for points at the upper edge of the view, where an object may continue above what was "
        "seen; raising it misses more truncated rocks and reports fewer false ones.",
        between(0.05, 1));
    v.renamed("fewest_points", "min_points");
    v.field("min_points", min_points,
            "Minimum number of points of an observed cell; raising it leaves sparsely covered cells unknown.",
            between(1, 1000));
    v.group("ground", ground);
    v.group("rover", rover);
  }
};

/// A point of the observed surface.
struct SurfacePoint {
  Eigen::Vector3f in_body;  ///< m, body frame.
  float sigma_m = 0;        ///< Standard deviation along the ray.
  Eigen::Vector3f ray;      ///< Direction of the ray, unit length, body frame.
  GroundClass kind = GroundClass::unknown;
  bool truncated = false;  ///< At the upper edge of the view: the object may continue above.
};

/// The points of all known pixels of a merged range image, in the body frame.
std::vector<SurfacePoint> surface_points(const MergedRange& merged);

class MapGenerator {
 public:
  MapGenerator(const MapOptions& options, ThreadPool workers) : options_(options), workers_(std::move(workers)) {}

  /// `map_from_body`: gravity-aligned; the map is centred on its origin. Cell corners are at integer multiples of the
  /// cell size. A cell's elevation is the inverse-variance weighted mean of its points; its class follows from the
  /// heights of its points above and below the fitted ground surface. Derivation: docs/math/stereo.md.
  LocalMap generate(std::span<const SurfacePoint> points, const Pose& map_from_body) const;

 private:
  MapOptions options_;
  ThreadPool workers_;
};

}  // namespace spartan
