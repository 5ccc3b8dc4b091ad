// The rig: cameras, their poses on the rover, and the stereo pairs they form; its native file format rig.yaml.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "spartan/core/frame_image.h"
#include "spartan/core/image.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/trajectory.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

/// Relative illumination, light at a pixel over light at the centre: 1 + a1 ρ² + a2 ρ⁴ + a3 ρ⁶, where ρ is the distance
/// from the centre over half the image diagonal. No coefficients: no vignetting.
struct Vignetting {
  std::vector<double> coefficients;          ///< a1, a2, a3; missing ones are 0
  std::optional<Eigen::Vector2d> centre_px;  ///< none: the principal point

  /// Smallest relative illumination that is corrected; amplifying darker pixels (more than 8 times) yields mostly
  /// noise.
  static constexpr double kMinIllumination = 0.125;

  /// Relative illumination at ρ².
  double relative_illumination(double rho_squared) const {
    double sum = 0;
    for (std::size_t i = coefficients.size(); i-- > 0;) sum = (sum + coefficients[i]) * rho_squared;
    return 1 + sum;
  }
  friend bool operator==(const Vignetting&, const Vignetting&) = default;
};

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

/// Which moment of the exposure a camera states with an image.
enum class StampAt { exposure_start, exposure_middle, exposure_end };

/// How a camera is reached and set in a live run.
struct CameraDriver {
  static constexpr const char* kFree = "free";          ///< the camera takes images by itself
  static constexpr const char* kSoftware = "software";  ///< Spartan triggers each image

  std::string source;           ///< "aravis:ID" or "gst:PIPELINE"; both cameras of a pair may name the same one
  std::string trigger = kFree;  ///< kFree, kSoftware, or the name of an input of the camera, e.g. "Line1"
  double rate_hz = 0;           ///< frames per second; 0: as the camera is set (free), or only on command (software)
  double black_level = 0;       ///< value of a stored sample without light
  StampAt stamp_at = StampAt::exposure_start;
  double latency_ms = 0;  ///< from the end of an exposure to the arrival of the first bytes, at least
  friend bool operator==(const CameraDriver&, const CameraDriver&) = default;
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
  std::optional<CameraDriver> driver = {};  ///< none: a camera of recordings

  /// Value of a stored sample without light, as the driver states it, to the nearest integer; 0 without one.
  int black_level() const;
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

/// Dimensions of the rover that maps and wheel odometry need.
struct RoverGeometry {
  double track_m = 0.6;         ///< distance between the left and the right wheels
  double wheel_radius_m = 0.1;  ///< radius of the wheels
  double clearance_m = 0.1;     ///< ground clearance
  friend bool operator==(const RoverGeometry&, const RoverGeometry&) = default;
};

/// Where the IMU is, and when.
struct ImuMount {
  Pose body_from_imu;        ///< its rotation is that of the axes of the readings in files
  double time_offset_s = 0;  ///< stamp of the IMU minus stamp of the cameras at the same moment
  friend bool operator==(const ImuMount&, const ImuMount&);
};

/// Standard deviations of the errors that a calibration leaves. The defaults are those of an ordinary rover
/// (`rover: ordinary` of the simulator).
struct CalibrationErrors {
  double pair_rotation_deg = 0.025;  ///< between the cameras of a pair, about each axis
  double scale_percent = 0.15;       ///< of ranges: focal length and baseline together
  double mount_rotation_deg = 0.15;  ///< of the mount of the cameras on the body, about each axis
  double mount_mm = 2;               ///< the same, along each axis
  double pan_tilt_deg = 0.1;         ///< of the angles that a pan-tilt unit reports
  friend bool operator==(const CalibrationErrors&, const CalibrationErrors&) = default;
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
  RoverGeometry rover;
  /// The point of the body that moves straight ahead when both sides' wheels turn equally, and stays when they turn
  /// oppositely: between the wheels.
  Eigen::Vector3d turning_centre_m = Eigen::Vector3d::Zero();
  ImuMount imu;
  std::optional<CalibrationErrors> calibration_errors;  ///< none: the calibration does not state how good it is
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

/// Reads a rig.yaml (docs/reference/rig.md) into a validated rig. Code `configuration` if the file cannot be read or is
/// invalid; the error lists all errors of the file, each with its line and key.
Result<Rig> read_rig_yaml(const std::string& path);
/// The same from memory; `name` is the name of the file in errors.
Result<Rig> parse_rig_yaml(const std::string& text, const std::string& name);
/// The rig as rig.yaml; parse_rig_yaml() restores it bit for bit.
std::string to_rig_yaml(const Rig& rig);

/// Converts world_from_body to the recording's convention (Rig::convention). `body`: unchanged. `left_optical`:
/// first_left_from_left, the left camera of the first pair relative to its pose at the first entry,
/// (T₀ B)⁻¹ Tᵢ B with B = body_from_left; independent of the world frame.
Trajectory in_recording_convention(const Rig& rig, Trajectory world_from_body);

/// Converts world_from_body to first_left_from_left of a pair, the convention of KITTI's pose files.
Trajectory in_left_optical_convention(const Rig& rig, const StereoPair& pair, Trajectory world_from_body);

/// Columns: by how much each error of the calibration, at one standard deviation, changes a motion.
using CalibrationEffect = Eigen::Matrix<double, 6, 8>;

/// Of a motion M of the camera that is transported to the body as B = X M X⁻¹ with a calibration X = body_from_left.
/// Rows: right perturbation of B = previous_from_current (translation, rotation; m, rad). The errors η of the mount (a
/// shift and a rotation, right perturbation of X), columns 0 to 5, cause
///
///     e = (I − Ad(B⁻¹)) Ad(X) η.
///
/// Column 6 is a relative error of the camera's translation (focal length and baseline), column 7 one of its rotation
/// (focal length). The errors are independent of each other and the same in all motions, so a motion has the covariance
/// E Eᵀ, and the sum of two (E₁ + E₂)(E₁ + E₂)ᵀ. A pan-tilt unit adds the errors of its angles to the rotation. Rigs
/// whose body is the camera (`left_optical`) have no error of the mount.
CalibrationEffect calibration_effect(const Pose& body_motion, const Pose& body_from_left, const Rig& rig,
                                     const StereoPair& pair, const CalibrationErrors& errors);

}  // namespace spartan
