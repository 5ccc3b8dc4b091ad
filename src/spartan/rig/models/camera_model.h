// The variant of all camera models. A new model is one file with the same members and one entry here (CONTRIBUTING.md,
// "A camera model").
#pragma once

#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "spartan/rig/models/cahv.h"
#include "spartan/rig/models/cahvor.h"
#include "spartan/rig/models/cahvore.h"
#include "spartan/rig/models/double_sphere.h"
#include "spartan/rig/models/equidistant.h"
#include "spartan/rig/models/pinhole.h"
#include "spartan/rig/models/radial_tangential.h"

namespace spartan {

/// One of the supported camera models.
using CameraModel = std::variant<PinholeModel, RadialTangentialModel, EquidistantModel, DoubleSphereModel, CahvModel,
                                 CahvorModel, CahvoreModel>;

/// The pixel of a point in the camera frame (m); nullopt outside of the domain of the model.
inline std::optional<Eigen::Vector2d> project(const CameraModel& model, const Eigen::Vector3d& point) {
  return std::visit([&](const auto& m) { return m.project(point); }, model);
}
/// The pixel and its 2×3 Jacobian by the point.
inline std::optional<ProjectionWithJacobian> project_with_jacobian(const CameraModel& model,
                                                                   const Eigen::Vector3d& point) {
  return std::visit([&](const auto& m) { return m.project_with_jacobian(point); }, model);
}
/// The ray of a pixel in the camera frame; nullopt if no ray of the domain projects to the pixel.
inline std::optional<Ray> unproject(const CameraModel& model, const Eigen::Vector2d& pixel) {
  return std::visit([&](const auto& m) { return m.unproject(pixel); }, model);
}

/// The name of the model in rig.yaml: "pinhole", "radial_tangential", "equidistant" ….
std::string_view name_of(const CameraModel& model);

/// The parameters of a model as rig.yaml stores them: the description of each key, and the values in the same order.
std::vector<ModelParameterSpec> parameter_specs(const CameraModel& model);
ModelParameters parameters(const CameraModel& model);

/// A model of that name with default parameters; nullopt if the name is unknown.
std::optional<CameraModel> camera_model_named(std::string_view name);
/// The same type of model with other parameter values, whose counts must match parameter_specs().
CameraModel with_parameters(const CameraModel& model, const ModelParameters& numbers);
/// The names of all models, for error messages.
std::vector<std::string_view> camera_model_names();

}  // namespace spartan
