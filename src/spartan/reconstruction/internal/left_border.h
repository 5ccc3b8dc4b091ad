// Wrong disparities at the left border of an image.
#pragma once

#include "spartan/core/image.h"
#include "spartan/reconstruction/v_disparity.h"

namespace spartan::internal {

/// Makes disparities unknown that lie below the ground by more than a quarter of the camera's height, in pixels of
/// which the ground has no partner: the column is smaller than the disparity of the plane. Ground and all above it
/// would have their partner outside of the right image; what is matched instead is texture that looks alike.
void drop_matches_below_ground(const GroundPlane& plane, const RectifiedStereo& geometry, Image<float>& disparity);

}  // namespace spartan::internal
