// Geometry of stereo rectification. The paper's sub-module "rectification".
#pragma once

#include <Eigen/Core>
#include <string>

#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/imaging/imaging_options.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// Requested geometry of the rectified images. Zero: chosen by the policy; size: that of the left image.
struct VirtualView {
  ViewPolicy policy = ViewPolicy::keep_resolution;
  ImageSize size{};
  double focal_px = 0;
  /// Depth at which the view is exact, m; 0: infinity. It only matters for non-central cameras, whose rays do not meet
  /// in one point.
  double depth_m = 0;

  /// Whether a size or a focal length is given.
  bool is_customized() const { return !size.empty() || focal_px != 0; }
};

/// Two virtual pinhole views with common rows. `left_from_rectified` rotates directions of the rectified left view into
/// the frame of the real left camera; `right_from_rectified` likewise.
struct Rectification {
  RectifiedStereo geometry;
  Eigen::Matrix3d left_from_rectified = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d right_from_rectified = Eigen::Matrix3d::Identity();
  double depth_m = 1;        ///< depth at which the view is exact, m; irrelevant for central cameras
  bool is_identity = false;  ///< the images are already rectified: no resampling
};

/// Computes the rectification of a pair. Axes: rectifying_axes(). Focal length, principal point and size:
/// choose_view(); by default the view keeps resolution and centre of the cameras and masks pixels outside of a sensor,
/// since a view of valid pixels only costs resolution or field of view with strong distortion. Cameras that are already
/// rectified (two equal pinholes without distortion, within 0.02 px) give the identity, unless a size or focal length
/// is given. Code `configuration`: a baseline more vertical or more along the optical axis than horizontal, left and
/// right camera swapped, optical axes more than 60° apart, or an impossible view. `where` names the pair in errors.
Result<Rectification> plan_rectification(const Camera& left, const Camera& right, const Pose& right_from_left,
                                         const std::string& where, const VirtualView& view = {});

/// The geometry under the assumption that the images are already rectified, whatever the rig says: focal length and
/// principal point of the left camera, length of the baseline.
Rectification assume_rectified(const Camera& left, const Pose& right_from_left);

}  // namespace spartan
