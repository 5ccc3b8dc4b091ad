// Ground truth: disparities of a frame and elevation maps.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/internal/camera/ground_scene.h"
#include "spartan/sim/simulator.h"

namespace spartan::sim::internal {

struct TrueDisparity {
  Image<float> disparity;    ///< px of the rectified left image; NaN where there is no truth
  Image<std::uint8_t> mask;  ///< 255 visible in both cameras, 128 in the left one only, 0 no truth
};

/// True disparities of one pair. A pixel of the rectified left view is mapped to the recorded image by the nominal
/// camera, to a ray by the true camera, to the ground, into the true right camera, and to the rectified right view by
/// the nominal camera: the column where a perfect matcher finds it. The pose of the right camera is given with each
/// frame, since it may drift.
class DisparityTruth {
 public:
  DisparityTruth(const Rig& true_rig, const Rig& nominal_rig, const StereoPair& pair, const RectifiedView& view);

  TrueDisparity of(const GroundScene& scene, const Pose& world_from_left, const Pose& right_from_left,
                   const ThreadPool& workers) const;

 private:
  void fill_row(const GroundScene& scene, const Pose& world_from_left, const Pose& right_from_left, int row,
                TrueDisparity& truth) const;

  RectifiedView view_;
  Camera true_right_, nominal_right_;
  std::vector<Eigen::Vector3f> directions_;  // in the true left camera; zero outside the recorded image
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

/// 1 ground, 2 obstacle (the surface is more than `obstacle_m` above the ground), 3 cavity (the surface is more than
/// `cavity_m` below the ground without cavities).
Image<float> classify_ground(const GroundMap& map, double obstacle_m, double cavity_m);

}  // namespace spartan::sim::internal
