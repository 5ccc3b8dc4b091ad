#include "spartan/rig/models/camera_model.h"

namespace spartan {

std::vector<ModelParameterSpec> CahvModel::parameter_specs() {
  std::vector<ModelParameterSpec> kinds = PinholeModel::parameter_specs();
  kinds.push_back({"skew_px", {1}});
  return kinds;
}

ModelParameters CahvModel::parameters() const {
  ModelParameters lists = core.parameters();
  lists.push_back({skew_px});
  return lists;
}

CahvModel CahvModel::from_parameters(const ModelParameters& parameters) {
  return {PinholeModel::from_parameters(parameters), parameters.at(2).at(0)};
}

std::optional<Eigen::Vector2d> CahvModel::project(const Eigen::Vector3d& point) const {
  if (!(point.z() > 0)) return std::nullopt;
  const double x = point.x() / point.z(), y = point.y() / point.z();
  const Eigen::Vector2d pixel(core.fx * x + core.cx, skew_px * x + core.fy * y + core.cy);
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<ProjectionWithJacobian> CahvModel::project_with_jacobian(const Eigen::Vector3d& point) const {
  const auto pixel = project(point);
  if (!pixel) return std::nullopt;
  // ∂(N/z) = (∂N − (N/z) ∂z)/z with N = P·H or P·V.
  ProjectionWithJacobian result{*pixel, {}};
  result.by_point << core.fx, 0, core.cx - pixel->x(), skew_px, core.fy, core.cy - pixel->y();
  result.by_point /= point.z();
  return result;
}

std::optional<Ray> CahvModel::unproject(const Eigen::Vector2d& pixel) const {
  if (!pixel.allFinite()) return std::nullopt;
  const double x = (pixel.x() - core.cx) / core.fx;
  const double y = (pixel.y() - core.cy - skew_px * x) / core.fy;
  return Ray{Eigen::Vector3d::Zero(), Eigen::Vector3d(x, y, 1).normalized()};
}

}  // namespace spartan
