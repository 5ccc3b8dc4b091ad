// What is really there: disparities of a shot, and the ground seen from above.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/ground_scene.h"

namespace spartan::sim {

/// How a pair's images are turned into rows that match, as whoever reads the recording will do it.
struct RectifiedView {
  RectifiedStereo geometry;
  Eigen::Matrix3d left_from_rectified = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d right_from_rectified = Eigen::Matrix3d::Identity();
};

struct TrueDisparity {
  Image<float> disparity;    ///< rectified left image; NaN where there is no truth
  Image<std::uint8_t> mask;  ///< 255 seen by both eyes, 128 by the left one only, 0 no truth
};

/// Disparities of one pair. A pixel of the rectified left view is followed back into the image as recorded by the
/// believed camera, out into the world by the true one, to the ground, into the true right camera, and forward again:
/// the column where a perfect matcher finds it.
class DisparityTruth {
 public:
  DisparityTruth(const Rig& true_rig, const Rig& believed_rig, const StereoPair& pair, const RectifiedView& view);

  TrueDisparity of(const GroundScene& scene, const Pose& world_from_left, const Workers& workers) const;

 private:
  void fill_row(const GroundScene& scene, const Pose& world_from_left, int row, TrueDisparity& truth) const;

  RectifiedView view_;
  Camera true_right_, believed_right_;
  Pose right_from_left_;
  std::vector<Eigen::Vector3f> directions_;  // in the true left camera; zero where the image as recorded ends
};

/// The ground from above, row 0 in the north (largest y); values at the cells' middles.
struct GroundMap {
  double west_m = 0, north_m = 0, cell_m = 0;
  Image<float> surface;  ///< with rocks, m
  Image<float> ground;   ///< without rocks, cavities included
  Image<float> level;    ///< without rocks and cavities
};

GroundMap map_ground(const TerrainShape& shape, const RockField& rocks, const Region& region, double cell_m,
                     const Workers& workers);

/// 1 ground, 2 obstacle (its surface is more than `obstacle_m` over the ground), 3 cavity (its surface is more than
/// `cavity_m` below the ground without cavities).
Image<float> classify_ground(const GroundMap& map, double obstacle_m, double cavity_m);

}  // namespace spartan::sim
