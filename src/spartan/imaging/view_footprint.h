// Which part of a camera's image a rectified view shows.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// 255 where the view shows a pixel of the camera, 0 elsewhere, told for blocks of 8 × 8 pixels by their middle.
/// `depth_m`: as for a RemapTable.
Image<std::uint8_t> view_footprint(const Camera& camera, const RectifiedStereo& view,
                                   const Eigen::Matrix3d& camera_from_rectified, double depth_m);

}  // namespace spartan
