#include "spartan/rig/models/camera_model.h"

namespace spartan {

std::vector<ModelParameterSpec> PinholeModel::parameter_specs() {
  // No real lens reaches this value; larger ones indicate a damaged file.
  constexpr double kMost_px = 1e7;
  return {{.key = "focal_px", .counts = {2}, .positive = true, .most = kMost_px},
          {.key = "centre_px", .counts = {2}, .least = -kMost_px, .most = kMost_px}};
}

ModelParameters PinholeModel::parameters() const {
  return {{fx, fy}, {cx, cy}};
}

PinholeModel PinholeModel::from_parameters(const ModelParameters& parameters) {
  const auto& focal = parameters.at(0);
  const auto& centre = parameters.at(1);
  return {focal.at(0), focal.at(1), centre.at(0), centre.at(1)};
}

std::optional<Eigen::Vector2d> PinholeModel::project(const Eigen::Vector3d& point) const {
  if (!(point.z() > 0)) return std::nullopt;
  const Eigen::Vector2d pixel(fx * (point.x() / point.z()) + cx, fy * (point.y() / point.z()) + cy);
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<ProjectionWithJacobian> PinholeModel::project_with_jacobian(const Eigen::Vector3d& point) const {
  const auto pixel = project(point);
  if (!pixel) return std::nullopt;
  const double x = point.x() / point.z(), y = point.y() / point.z();
  ProjectionWithJacobian result{*pixel, {}};
  result.by_point << fx, 0, -fx * x, 0, fy, -fy * y;
  result.by_point /= point.z();
  return result;
}

std::optional<Ray> PinholeModel::unproject(const Eigen::Vector2d& pixel) const {
  if (!pixel.allFinite()) return std::nullopt;
  return Ray{Eigen::Vector3d::Zero(), Eigen::Vector3d((pixel.x() - cx) / fx, (pixel.y() - cy) / fy, 1).normalized()};
}

}  // namespace spartan
