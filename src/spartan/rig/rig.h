// The rig: cameras, their poses on the rover, and the stereo pairs they form.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/pixel_format.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/rig/models/camera_model.h"
#include "spartan/rig/vignetting.h"

namespace spartan {

/// A pan-tilt unit. Its head frame is named like the unit and coincides with the base at pan = tilt = 0.
/// Pan turns about the base's z (positive to the left), then tilt about the panned y (positive looks down).
struct PanTiltUnit {
  std::string name = "mast";
  Pose body_from_base;
  double rest_pan_rad = 0, rest_tilt_rad = 0;  ///< default angles

  /// body_from_head at the given angles (rad): body_from_base · Rz(pan) · Ry(tilt).
  Pose body_from_head(double pan_rad, double tilt_rad) const;
  friend bool operator==(const PanTiltUnit&, const PanTiltUnit&);  ///< bit for bit, as for all of a rig
};

/// One camera: image size, camera model, photometric properties and pose on its mount.
struct Camera {
  std::string name;
  ImageSize size;
  CameraModel model;
  PixelFormat pixel_format;    ///< default: `gray`, 8 bits
  Vignetting vignetting;       ///< corrected by the imaging module
  std::string self_mask;       ///< image file, 0 where the rover is visible; empty: none. Relative to the rig file
  std::string mount = "body";  ///< "body" or the name of a pan-tilt unit
  Pose mount_from_camera;      ///< camera: optical frame (x right, y down, z forward)
  friend bool operator==(const Camera&, const Camera&);
};

/// Two cameras on the same mount that take synchronous images.
struct StereoPair {
  std::string name;
  std::string left, right;   ///< camera names
  double nearest_m = 0;      ///< smallest depth z to match, bounds the disparity; 0: not given
  bool for_odometry = true;  ///< false: used only at stops (a panned pair)
  friend bool operator==(const StereoPair&, const StereoPair&) = default;
};

/// The frames of a recording's own poses; exports and comparisons with ground truth use it.
enum class PoseConvention {
  body,          ///< world_from_body, world z up
  left_optical,  ///< first left optical frame from left optical frame (KITTI)
};

/// One error of a rig, as found by Rig::validation_errors().
struct RigValidationError {
  std::string key;  ///< as in rig.yaml, "cameras.left.focal_px"
  std::string what;
};

/// All cameras of a rover and their geometry. The body frame is x forward, y left, z up.
struct Rig {
  std::string name;
  PoseConvention convention = PoseConvention::body;
  std::vector<PanTiltUnit> pan_tilt_units;
  std::vector<Camera> cameras;
  std::vector<StereoPair> pairs;

  const Camera* find_camera(const std::string& camera) const;
  const StereoPair* find_pair(const std::string& pair) const;
  /// body_from_camera; the angles apply to cameras on a pan-tilt unit only. Throws std::invalid_argument for unknown
  /// names.
  Pose body_from_camera(const std::string& camera, double pan_rad, double tilt_rad) const;
  /// The same at the rest angles of the pan-tilt unit.
  Pose body_from_camera(const std::string& camera) const;
  /// right_from_left of a pair. Throws std::invalid_argument for unknown names.
  Pose right_from_left(const StereoPair& pair) const;

  /// All errors: unknown or duplicate names, sizes and focal lengths that are not positive, values that are not finite,
  /// two cameras of a pair at one position or on different mounts, no pair.
  std::vector<RigValidationError> validation_errors() const;
  /// All of validation_errors() in one error (code `configuration`), one line each: "where: key: what".
  Status validate(const std::string& where) const;
  friend bool operator==(const Rig&, const Rig&) = default;
};

/// The rotation from body axes (x forward, y left, z up) to optical axes (x right, y down, z forward).
Pose optical_from_forward();

/// A rig of one pair without a body frame of its own: the body is the left camera, rotated to x forward, y left, z up
/// (docs/conventions.md: recordings without a body frame). Poses follow the `left_optical` convention.
Rig rig_of_one_pair(const std::string& name, Camera left, Camera right, const Pose& right_from_left);

}  // namespace spartan
