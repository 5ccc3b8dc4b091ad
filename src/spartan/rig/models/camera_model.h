// Any camera model. A further model is one file with the same members and one more entry here
// (CONTRIBUTING.md, "A camera model").
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

using CameraModel = std::variant<PinholeModel, RadialTangentialModel, EquidistantModel, DoubleSphereModel, CahvModel,
                                 CahvorModel, CahvoreModel>;

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

/// The name that rig.yaml uses: "pinhole", "radial_tangential", "equidistant" ….
std::string_view name_of(const CameraModel& model);

/// What rig.yaml holds of a model: its kinds of parameters and their numbers.
std::vector<ModelParameterKind> parameter_kinds(const CameraModel& model);
ModelParameters parameters(const CameraModel& model);

/// The model of that name with its default parameters, to ask for its kinds; none where the name is unknown.
std::optional<CameraModel> camera_model_named(std::string_view name);
/// The same kind of model with other numbers; their counts must be allowed ones.
CameraModel with_parameters(const CameraModel& model, const ModelParameters& numbers);
/// The names of all models, for messages.
std::vector<std::string_view> camera_model_names();

}  // namespace spartan
