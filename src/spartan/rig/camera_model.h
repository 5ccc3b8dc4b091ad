// Any camera model. A further model is one file with the same three members and one more entry here
// (CONTRIBUTING.md, "A camera model").
#pragma once

#include <optional>
#include <string_view>
#include <variant>

#include "spartan/rig/pinhole.h"
#include "spartan/rig/radial_tangential.h"

namespace spartan {

using CameraModel = std::variant<PinholeModel, RadialTangentialModel>;

inline std::optional<Eigen::Vector2d> project(const CameraModel& model, const Eigen::Vector3d& point) {
  return std::visit([&](const auto& m) { return m.project(point); }, model);
}
inline std::optional<ProjectionWithJacobian> project_with_jacobian(const CameraModel& model,
                                                                   const Eigen::Vector3d& point) {
  return std::visit([&](const auto& m) { return m.project_with_jacobian(point); }, model);
}
inline std::optional<Ray> unproject(const CameraModel& model, const Eigen::Vector2d& pixel) {
  return std::visit([&](const auto& m) { return m.unproject(pixel); }, model);
}

/// The name that rig.yaml uses: "pinhole", "radial_tangential".
std::string_view name_of(const CameraModel& model);

}  // namespace spartan
