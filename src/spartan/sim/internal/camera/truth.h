// Ground truth: disparities of a frame and elevation maps.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/internal/camera/ground_scene.h"
#include "spartan/sim/internal/camera/renderer.h"
#include "spartan/sim/internal/camera/rover_body.h"
#include "spartan/sim/simulator.h"

namespace spartan::sim::internal {

struct TrueDisparity {
  Image<float> disparity;    ///< px of the rectified left image; NaN where there is no truth
  Image<std::uint8_t> mask;  ///< 255 visible in both cameras, 128 in the left one only, 0 no truth
};

/// Where the cameras of a pair are when their rows are exposed.
struct PairPoses {
  ShutterPose world_from_left, world_from_right;
  const RoverBody* rover = nullptr;  ///< borrowed; where it is visible there is no truth
  ShutterPose world_from_body;
};

/// True disparities of one pair. A pixel of the rectified left view is mapped to the recorded image by the nominal
/// camera, to a ray by the true camera, to the ground, into the true right camera, and to the rectified right view by
/// the nominal camera: the column where a perfect matcher finds it. Where a shutter rolls, each row has its own pose.
class DisparityTruth {
 public:
  DisparityTruth(const Rig& true_rig, const Rig& nominal_rig, const StereoPair& pair, const RectifiedView& view);

  TrueDisparity of(const GroundScene& scene, const PairPoses& poses, const ThreadPool& workers) const;

 private:
  void fill_row(const GroundScene& scene, const PairPoses& poses, int row, TrueDisparity& truth) const;
  // The pixel of the recorded right image that shows a point.
  std::optional<Eigen::Vector2d> right_pixel(const PairPoses& poses, const Eigen::Vector3d& point) const;

  RectifiedView view_;
  Camera true_right_, nominal_right_;
  std::vector<Eigen::Vector3f> directions_;  // in the true left camera; zero outside the recorded image
  std::vector<float> row_parts_;             // of the recorded left image, from 0 at its top to 1 at its bottom
};

/// Elevation maps, row 0 in the north (largest y); values at cell centres.
struct GroundMap {
  double west_m = 0, north_m = 0, cell_m = 0;
  Image<float> surface;  ///< m; with rocks
  Image<float> ground;   ///< m; without rocks, with cavities
  Image<float> level;    ///< m; without rocks and cavities
};

GroundMap map_ground(const TerrainShape& shape, const RockField& rocks, const Region& region, double cell_m,
                     const ThreadPool& workers);

/// 1 ground, 2 obstacle (the surface is more than `obstacle_m` above the ground without cavities), 3 cavity (the
/// surface is more than `cavity_m` below it).
Image<float> classify_ground(const GroundMap& map, double obstacle_m, double cavity_m);

}  // namespace spartan::sim::internal
