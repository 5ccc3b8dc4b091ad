// Which virtual pair of pinholes stands for two real cameras: the geometry of the sub-module "rectification".
#pragma once

#include <Eigen/Core>
#include <string>

#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/imaging/virtual_view.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// Two views with common rows. A direction of the rectified left view is `left_from_rectified` times it in the axes of
/// the real left camera; the same for the right one.
struct Rectification {
  RectifiedStereo geometry;
  Eigen::Matrix3d left_from_rectified = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d right_from_rectified = Eigen::Matrix3d::Identity();
  double depth_m = 1;           ///< for which the view is right; central cameras do not care
  bool passes_through = false;  ///< the images are rectified already: nothing is resampled
};

/// Axes: rectifying_axes().
/// Focal length, centre and size: choose_view(). By default the view keeps resolution and centre, and pixels that look
/// past a sensor are masked; a zoom to valid pixels only would cost resolution or view on every pair with strong
/// distortion.
/// Eyes that are rectified already (two equal pinholes without distortion, within 0.02 px) pass through, unless a size
/// or a focal length is asked for.
/// Code `configuration`: baseline more vertical or more along the axis than horizontal, eyes swapped, axes more than
/// 60° apart, or no view as asked for. `where` names the pair in errors.
Result<Rectification> plan_rectification(const Camera& left, const Camera& right, const Pose& right_from_left,
                                         const std::string& where, const VirtualView& view = {});

/// The geometry under the belief that the images are rectified, whatever the rig says: the left eye's focal length and
/// centre and the length of the baseline.
Rectification assume_rectified(const Camera& left, const Pose& right_from_left);

}  // namespace spartan
