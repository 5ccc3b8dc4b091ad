// Choice of focal length, principal point and size of the rectified images.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "spartan/core/result.h"
#include "spartan/imaging/imager.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// The depth to project at, m: `depth_m`, or for infinity 2²⁰ m, where ray origins do not matter.
double effective_depth(const VirtualView& view);

/// A camera and its rotation to the axes of the rectified view.
struct RotatedCamera {
  const Camera& camera;
  Eigen::Matrix3d camera_from_rectified;
};

/// Focal length, principal point and size (not the baseline) of the rectified images. The principal point is such that:
/// keep_resolution: the mean outline of both fields of view is at the image centre; all_valid: the view is the widest;
/// whole_view: the bounding box of both fields of view is at the image centre.
/// Code `configuration` where the view is impossible: a size below 2 × 2 px or above 2²⁶ px in total; a focal length or
/// depth that is negative or not finite; a camera that sees more than 85° from the optical axis of the view
/// (whole_view); no common rectangle, or a given focal length too short for it (all_valid); a given focal length too
/// long for the size (whole_view). `where` names the pair in errors.
Result<RectifiedStereo> choose_view(const RotatedCamera& left, const RotatedCamera& right, const VirtualView& view,
                                    const std::string& where);

/// Resolution on the optical axis in px/rad: the geometric mean of both image directions. Nothing where the model
/// cannot project the axis.
std::optional<double> resolution_on_axis(const Camera& camera, double depth_m = 1);

}  // namespace spartan::internal
