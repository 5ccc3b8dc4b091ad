// The driver of a camera in rig.yaml.
#pragma once

#include <string>

#include "spartan/core/strict_yaml.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// Reads a `driver:` block; errors go to those of the file.
CameraDriver read_camera_driver(YamlMap map);
/// The lines of the block, indented as part of a camera.
std::string camera_driver_lines(const CameraDriver& driver);

}  // namespace spartan::internal
