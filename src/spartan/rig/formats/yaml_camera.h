// What the YAML files of EuRoC, Kalibr and ROS have in common. Internal to rig.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "spartan/core/pose.h"
#include "spartan/rig/models/camera_model.h"
#include "spartan/rig/rig.h"
#include "spartan/rig/yaml_bridge.h"

namespace spartan::rig_detail {

/// The file as YAML. OpenCV's first line "%YAML:1.0", which is no directive of YAML, is passed over.
Result<YAML::Node> load_yaml_file(const std::string& path);

/// Width and height in a list of two whole numbers.
ImageSize read_resolution(YamlMap& map, std::string_view key);

/// camera_model, intrinsics, distortion_model and the list `distortion_key`, as Kalibr names them:
/// pinhole [fx fy cx cy] with radtan, equidistant or none; omni [ξ fx fy cx cy], ds [ξ α …] and eucm [α β …] without
/// distortion, eucm with β = 1. Reports what else is there.
CameraModel read_kalibr_model(YamlMap& map, std::string_view distortion_key);
/// The same lines, each beginning with `indent`; where Kalibr has no such model, an error (see cannot_hold()).
Result<std::string> kalibr_model_lines(const Camera& camera, std::string_view distortion_key, std::string_view indent);

/// A rigid transform from 16 numbers, row by row; reports under `key` what is none.
std::optional<Pose> read_rigid(YamlMap& map, std::string_view key, const std::vector<double>& rows);

/// fx, fy, cx, cy from nine numbers, row by row; reports under `key` where they are no camera matrix.
std::optional<PinholeModel> read_camera_matrix(YamlMap& map, std::string_view key, const std::vector<double>& rows);

}  // namespace spartan::rig_detail
