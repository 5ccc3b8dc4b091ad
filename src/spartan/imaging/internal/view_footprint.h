// Footprint of the rectified view in the camera image.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// Mask in camera pixels: 255 where the pixel is inside the rectified view, else 0. Evaluated at the centres of blocks
/// of 8 × 8 pixels. `depth_m`: as for a RemapTable.
Image<std::uint8_t> view_footprint(const Camera& camera, const RectifiedStereo& view,
                                   const Eigen::Matrix3d& camera_from_rectified, double depth_m);

}  // namespace spartan::internal
