// Which part of what two eyes see the rectified view shows, and how large.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>

#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/rig/rig.h"

namespace spartan {

enum class ViewPolicy : std::uint8_t {
  keep_resolution,  ///< the eyes' resolution on their axes; pixels that look past a sensor are masked
  all_valid,        ///< as much as can be shown without a pixel that an eye does not see
  whole_view,       ///< everything that either eye sees, at the cost of resolution and masked pixels
};

/// What the rectified view shall be. Zeros: as the policy has it, and the left image's size.
struct VirtualView {
  ViewPolicy policy = ViewPolicy::keep_resolution;
  ImageSize size{};
  double focal_px = 0;
  /// Depth of the surface for which the view is right, metres; 0: far away. It only matters for cameras whose rays do
  /// not meet in one point.
  double depth_m = 0;

  bool is_chosen() const { return !size.empty() || focal_px != 0; }
};

/// The depth to put into projections: `depth_m`, or one where no camera's offsets matter.
double depth_of(const VirtualView& view);

/// A camera whose axes are turned into those of the rectified view: camera_from_rectified.
struct TurnedEye {
  const Camera& camera;
  Eigen::Matrix3d camera_from_rectified;
};

/// Focal length, centre and size (not the baseline). The centre: keep_resolution, the mean outline of what the two eyes
/// see stands in the middle; all_valid, where the view is largest; whole_view, what the eyes see is in the middle.
/// Code `configuration` where there is no such view: a size below 2 × 2 px or above 2²⁶ px in all, a focal length or a
/// depth that is negative or not finite, an eye sees more than 85° from the view's axis (whole_view), the
/// eyes have no rectangle in common or the chosen focal length is too short for it (all_valid), or too long for all to
/// fit into the size (whole_view).
Result<RectifiedStereo> choose_view(const TurnedEye& left, const TurnedEye& right, const VirtualView& view,
                                    const std::string& where);

/// Pixels per radian on the optical axis, the geometric mean of both directions.
std::optional<double> resolution_on_axis(const Camera& camera, double depth_m = 1);

}  // namespace spartan
