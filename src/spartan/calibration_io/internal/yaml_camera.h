// Common parts of the YAML files of EuRoC, Kalibr and ROS. Internal to calibration_io.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "spartan/core/pose.h"
#include "spartan/core/strict_yaml.h"
#include "spartan/rig/models/camera_model.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// Loads a YAML file. A first line "%YAML:1.0" of OpenCV, which is not a valid YAML directive, is ignored.
Result<YamlNode> load_yaml_file(const std::string& path);

/// Width and height from a list of two positive integers; empty if they are invalid, which is reported.
ImageSize read_resolution(YamlMap& map, std::string_view key);

/// camera_model, intrinsics, distortion_model and the list `distortion_key`, as Kalibr names them:
/// pinhole [fx fy cx cy] with radtan, equidistant or none; omni [ξ fx fy cx cy], ds [ξ α …] and eucm [α β …] without
/// distortion, eucm only with β = 1. Other models are reported as errors.
CameraModel read_kalibr_model(YamlMap& map, std::string_view distortion_key);
/// Formats the same lines, each beginning with `indent`; an error (see cannot_hold()) if Kalibr does not support the
/// model.
Result<std::string> kalibr_model_lines(const Camera& camera, std::string_view distortion_key, std::string_view indent);

/// A rigid transform from a row-major 4×4 matrix; an invalid one is reported under `key`.
std::optional<Pose> read_rigid(YamlMap& map, std::string_view key, const std::vector<double>& rows);

/// fx, fy, cx, cy from a row-major 3×3 camera matrix; an invalid one is reported under `key`.
std::optional<PinholeModel> read_camera_matrix(YamlMap& map, std::string_view key, const std::vector<double>& rows);

}  // namespace spartan::internal
