// Map generation: a point cloud becomes a local map with obstacles, cavities and traversal costs.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/options.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/disparity_merger.h"
#include "spartan/reconstruction/local_map.h"
#include "spartan/reconstruction/v_disparity.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// Options of the robust fit of the ground surface beneath rocks and above pits.
struct GroundSurfaceOptions {
  double window_m = 1.8;           ///< Diameter of the neighbourhood of one fit, m.
  double node_spacing_m = 0.2;     ///< Distance between the nodes at which the surface is fitted, m.
  double initial_scale_m = 0.12;   ///< Scale of the robust weights in the first weighted round, m.
  double final_scale_m = 0.03;     ///< Scale of the robust weights in the last round, m.
  double non_ground_weight = 0.2;  ///< Weight of cells that are not marked as ground; 1: the same as ground.

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("window_m", window_m,
            "Diameter of the neighbourhood to which the ground surface is fitted, in metres; raising it bridges larger "
            "rocks and follows the terrain less closely. It should be more than twice the size of the largest rock.",
            between(0.1, 100));
    v.renamed("lattice_m", "node_spacing_m");
    v.field("node_spacing_m", node_spacing_m,
            "Distance in metres between the nodes at which the ground surface is fitted; it is interpolated between "
            "them, and raising it is faster and coarser.",
            between(0.01, 10));
    v.renamed("coarse_m", "initial_scale_m");
    v.field(
        "initial_scale_m", initial_scale_m,
        "Scale of the Geman-McClure weights in the first weighted round, in metres: a cell with that residual has a "
        "quarter of the full weight; raising it helps on uneven ground.",
        between(0.001, 10));
    v.renamed("fine_m", "final_scale_m");
    v.field("final_scale_m", final_scale_m,
            "Scale of the Geman-McClure weights in the last round, in metres; raising it lets low rocks and shallow "
            "pits bias the fitted surface.",
            between(0.001, 10));
    v.renamed("doubtful_weight", "non_ground_weight");
    v.field("non_ground_weight", non_ground_weight,
            "Weight of cells that v-disparity does not classify as ground, relative to ground cells; 0 excludes them.",
            between(0, 1));
  }
};

/// Fits a second-order surface to the cells around every node of a regular lattice by iteratively reweighted least
/// squares with Geman-McClure weights, w = 1/(1 + (r/s)²)², whose scale s falls from the initial to the final one
/// (graduated non-convexity), so that rocks and pits smaller than half of the window are outliers. Between the nodes
/// the surface is interpolated bilinearly. `elevation_m`: NaN where unknown. `ground`: not 0 where a cell is known to
/// be ground beforehand. The result has the size of `elevation_m`, in metres; NaN where fewer than six cells are near.
Image<float> fit_ground(ImageView<const float> elevation_m, ImageView<const std::uint8_t> ground, double cell_m,
                        const GroundSurfaceOptions& options, const ThreadPool& workers);

/// Limits of the rover for which traversal costs are computed: a roughness of half the wheel radius, an object as high
/// as the ground clearance, a slope of max_slope_deg or a step of max_step_m has cost 1. Slope and roughness are fitted
/// over a square of half the track.
struct RoverLimits {
  RoverGeometry geometry;     ///< of the rig file (Rig::rover)
  double max_slope_deg = 20;  ///< degrees
  double max_step_m = 0.08;   ///< m

  template <class Visitor>
  void describe(Visitor& v) {
    v.former("wheel_radius_m", geometry.wheel_radius_m, RoverGeometry().wheel_radius_m,
             "rover.wheel_radius_m in the rig file", between(0.01, 5));
    v.former("clearance_m", geometry.clearance_m, RoverGeometry().clearance_m, "rover.clearance_m in the rig file",
             between(0.01, 5));
    v.former("track_m", geometry.track_m, RoverGeometry().track_m, "rover.track_m in the rig file", between(0.05, 10));
    v.renamed("steepest_deg", "max_slope_deg");
    v.field("max_slope_deg", max_slope_deg,
            "Steepest traversable slope in degrees; at that slope the cost reaches its maximum of 1, and raising it "
            "lowers the cost of "
            "slopes.",
            between(1, 80));
    v.renamed("highest_step_m", "max_step_m");
    v.field("max_step_m", max_step_m,
            "Highest traversable step between neighbouring cells in metres; at that height the cost reaches its "
            "maximum of 1, and raising it "
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

/// Standard deviations of what calibration and actuators get wrong. Errors of one kind move all points of a view
/// together, so that neighbouring cells and further observations do not average them.
struct CalibrationErrorOptions : CalibrationErrors {
  template <class Visitor>
  void describe(Visitor& v) {
    v.field("pair_rotation_deg", pair_rotation_deg,
            "Standard deviation in degrees of the rotation between the cameras of a pair that the calibration leaves; "
            "it changes all disparities, and raising it raises the variance of distant cells.",
            between(0, 10));
    v.field("scale_percent", scale_percent,
            "Standard deviation in percent of the scale of ranges, from focal length and baseline; raising it raises "
            "the variance of cells in proportion to the squared height of the camera above them.",
            between(0, 50));
    v.field("mount_rotation_deg", mount_rotation_deg,
            "Standard deviation in degrees of the rotation of the cameras' mount on the body; raising it raises the "
            "variance of distant cells.",
            between(0, 45));
    v.field("mount_mm", mount_mm,
            "Standard deviation in millimetres of the position of the cameras' mount on the body; it adds to the "
            "variance of all cells alike.",
            between(0, 1000));
    v.field("pan_tilt_deg", pan_tilt_deg,
            "Standard deviation in degrees of the reported pan and tilt angles; without effect, unless changed, for "
            "rigs whose pairs are all fixed to the body. Raising it raises the variance of distant cells.",
            between(0, 45));
  }
};

struct MapOptions {
  double extent_m = 8;      ///< Side of the square map, m.
  double cell_m = 0.05;     ///< Side of a cell, m.
  double obstacle_m = 0.1;  ///< Minimum height of an obstacle above the ground surface, m.
  double cavity_m = 0.1;    ///< Minimum depth of a cavity (negative obstacle) below the ground surface, m.
  double truncated_obstacle_factor =
      0.3;                         ///< Factor on obstacle_m where the upper edge of the view truncates an object.
  int min_points = 1;              ///< Minimum number of points of an observed cell.
  double trimmed_fraction = 0.05;  ///< Fraction of a cell's points left out at each end of their heights.
  int min_support_cells = 4;       ///< A smaller group of cells that stands apart is unknown.
  GroundSurfaceOptions ground;
  RoverLimits rover;
  CalibrationErrorOptions calibration;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("extent_m", extent_m,
            "Side of the square local map in metres; raising it covers terrain farther from the rover and costs memory "
            "and time.",
            between(0.5, 1000));
    v.field("cell_m", cell_m,
            "Side of a map cell in metres; raising it averages more points per cell and loses small obstacles.",
            between(0.005, 10));
    v.check("cell_m", extent_m <= 10000 * cell_m,
            "is less than 1/10000 of extent_m; the map would have too many cells");
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
    v.field("trimmed_fraction", trimmed_fraction,
            "Fraction of the points of a cell that is left out at the upper and at the lower end of their heights; "
            "raising it suppresses more wrong matches and the tips of rocks.",
            between(0, 0.45));
    v.field("min_support_cells", min_support_cells,
            "A group of fewer cells that stands apart from its neighbours by more than three cell sizes in height is "
            "left unknown, as wrong matches are, also where all cells around it are unknown; 1 retains all.",
            between(1, 1000));
    v.group("ground", ground);
    v.group("rover", rover);
    v.group("calibration", calibration);
  }
};

/// A point of the observed surface.
struct SurfacePoint {
  Eigen::Vector3f in_body;  ///< m, body frame.
  float sigma_m = 0;        ///< Standard deviation along the ray.
  Eigen::Vector3f ray;      ///< Direction of the ray, unit length, body frame.
  GroundClass kind = GroundClass::unknown;
  bool truncated = false;  ///< At the upper edge of the view: the object may continue above.
  float range_m = 0;       ///< From the camera; 0: unknown, without errors of the calibration.
  float baseline_m = 0;    ///< Of the pair that saw it; 0: unknown.
};

/// The points of all known pixels of a merged range image, in the body frame.
std::vector<SurfacePoint> surface_points(const MergedRange& merged);

/// Mean position of the points of a cell relative to its centre, in cells.
struct CellOffset {
  float east = 0, north = 0;
};

/// Elevations of a map's cells at their centres, m. `means_m`: mean elevation of the points of each cell, NaN where
/// unknown; `offsets` has its size. A distant cell may hold a single row of points, and of ground behind a crest only
/// what lies next to it is seen. The elevation moves along the slope to the neighbours, the smaller one of both sides
/// and none where their signs differ (minmod limiter: Roe, "Characteristic-based schemes for the Euler equations",
/// Annual Review of Fluid Mechanics 1986).
Image<float> at_cell_centres(ImageView<const float> means_m, ImageView<const CellOffset> offsets);

class MapGenerator {
 public:
  /// Code `configuration` where an option is out of bounds.
  static Result<MapGenerator> create(const MapOptions& options, ThreadPool workers);

  /// `map_from_body`: gravity-aligned; the map is centred on its origin. Cell corners are at integer multiples of the
  /// cell size. A cell's elevation is the inverse-variance weighted mean of its points, moved along the slope of the
  /// neighbouring cells from the mean position of the points to the centre of the cell; its class follows from the
  /// heights of its points above and below the fitted ground surface. Its variance is that of a point by the noise of
  /// disparities plus that by errors of the calibration, which has no influence on the class. Derivation:
  /// docs/math/stereo.md.
  LocalMap generate(std::span<const SurfacePoint> points, const Pose& map_from_body) const;

 private:
  MapGenerator(const MapOptions& options, ThreadPool workers) : options_(options), workers_(std::move(workers)) {}

  MapOptions options_;
  ThreadPool workers_;
};

}  // namespace spartan
