// The rig: cameras, where they sit, which of them form stereo pairs.
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
  double rest_pan_rad = 0, rest_tilt_rad = 0;  ///< the angles where nothing else is said

  /// body_from_head at the given angles (rad): body_from_base · Rz(pan) · Ry(tilt).
  Pose body_from_head(double pan_rad, double tilt_rad) const;
  friend bool operator==(const PanTiltUnit&, const PanTiltUnit&);  ///< bit for bit, as for all of a rig
};

struct Camera {
  std::string name;
  ImageSize size;
  CameraModel model;
  PixelFormat pixel_format;    ///< what its images hold; `gray` of 8 bits unless the rig says otherwise
  Vignetting vignetting;       ///< undone by imaging
  std::string self_mask;       ///< picture file, 0 where the rover sees itself; empty: none. Relative to the rig file
  std::string mount = "body";  ///< "body" or the name of a pan-tilt unit
  Pose mount_from_camera;      ///< camera: optical frame (x right, y down, z forward)
  friend bool operator==(const Camera&, const Camera&);
};

struct StereoPair {
  std::string name;
  std::string left, right;   ///< camera names
  double nearest_m = 0;      ///< depth z before the eyes; nothing nearer has to be matched; 0: not stated
  bool for_odometry = true;  ///< false: only looked at where the rover stops (a panned pair)
  friend bool operator==(const StereoPair&, const StereoPair&) = default;
};

/// In which frame the recording itself gives poses; exports and comparisons with outside truth use it.
enum class PoseConvention {
  body,          ///< world_from_body, world z up
  left_optical,  ///< first left optical frame from left optical frame (KITTI)
};

/// One thing wrong with a rig.
struct RigFault {
  std::string key;  ///< as in rig.yaml, "cameras.left.focal_px"
  std::string what;
};

struct Rig {
  std::string name;
  PoseConvention convention = PoseConvention::body;
  std::vector<PanTiltUnit> pan_tilt_units;
  std::vector<Camera> cameras;
  std::vector<StereoPair> pairs;

  const Camera* find_camera(const std::string& camera) const;
  const StereoPair* find_pair(const std::string& pair) const;
  /// body_from_camera; the angles count for cameras on a pan-tilt unit only. Throws on an unknown name.
  Pose body_from_camera(const std::string& camera, double pan_rad, double tilt_rad) const;
  /// The same with the unit's angles of rest.
  Pose body_from_camera(const std::string& camera) const;
  /// right_from_left of a pair. Throws on an unknown name.
  Pose right_from_left(const StereoPair& pair) const;

  /// Every fault of the rig: unknown or doubled names, sizes and focal lengths that are not positive, values that
  /// are not finite, two eyes at one place or on different mounts, no pair.
  std::vector<RigFault> find_faults() const;
  /// All of find_faults() in one error (code `configuration`), one line each: "where: key: what".
  Status validate(const std::string& where) const;
  friend bool operator==(const Rig&, const Rig&) = default;
};

/// Turns x forward, y left, z up into x right, y down, z forward: optical_from_body axes.
Pose optical_from_forward();

/// A rig of one pair whose body is the left camera turned to x forward, y left, z up (docs/conventions.md:
/// recordings without a body frame). Poses follow the `left_optical` convention.
Rig rig_of_one_pair(const std::string& name, Camera left, Camera right, const Pose& right_from_left);

}  // namespace spartan
