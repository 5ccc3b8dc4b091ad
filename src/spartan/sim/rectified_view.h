// The rectification that true disparities refer to.
#pragma once

#include <Eigen/Core>

#include "spartan/rig/rectified_stereo.h"

namespace spartan::sim {

/// Rectified geometry of a pair and its rotations, as the reader of the recording will compute them from the nominal
/// rig.
struct RectifiedView {
  RectifiedStereo geometry;
  Eigen::Matrix3d left_from_rectified = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d right_from_rectified = Eigen::Matrix3d::Identity();
};

}  // namespace spartan::sim
