#include <Eigen/Geometry>
#include <cmath>

#include "spartan/rig/models/camera_model.h"

namespace spartan {
namespace {

// The quantities of the formula in the header for one point.
struct Spheres {
  double d1, h, d2, denominator;
};

std::optional<Spheres> spheres_of(const DoubleSphereModel& m, const Eigen::Vector3d& point) {
  const double d1 = point.norm();
  const double h = m.xi * d1 + point.z();
  const double d2 = std::sqrt(point.head<2>().squaredNorm() + h * h);
  const double w = m.alpha <= 0.5 ? m.alpha / (1 - m.alpha) : (1 - m.alpha) / m.alpha;
  const double denominator = m.alpha * d2 + (1 - m.alpha) * h;
  const bool inside = h > -w * d2 && d1 + m.xi * point.z() > 0 && denominator > 0;
  return inside ? std::optional(Spheres{d1, h, d2, denominator}) : std::nullopt;
}

}  // namespace

std::vector<ModelParameterSpec> DoubleSphereModel::parameter_specs() {
  std::vector<ModelParameterSpec> kinds = PinholeModel::parameter_specs();
  kinds.push_back({"xi", {1}});
  kinds.push_back({.key = "alpha", .counts = {1}, .least = 0, .most = 1});
  return kinds;
}

ModelParameters DoubleSphereModel::parameters() const {
  ModelParameters lists = pinhole.parameters();
  lists.push_back({xi});
  lists.push_back({alpha});
  return lists;
}

DoubleSphereModel DoubleSphereModel::from_parameters(const ModelParameters& parameters) {
  return {PinholeModel::from_parameters(parameters), parameters.at(2).at(0), parameters.at(3).at(0)};
}

std::optional<Eigen::Vector2d> DoubleSphereModel::project(const Eigen::Vector3d& point) const {
  const auto s = spheres_of(*this, point);
  if (!s) return std::nullopt;
  const Eigen::Vector2d pixel(pinhole.fx * (point.x() / s->denominator) + pinhole.cx,
                              pinhole.fy * (point.y() / s->denominator) + pinhole.cy);
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<ProjectionWithJacobian> DoubleSphereModel::project_with_jacobian(const Eigen::Vector3d& point) const {
  const auto pixel = project(point);
  const auto s = spheres_of(*this, point);
  if (!pixel || !s) return std::nullopt;
  // ∂d1 = p/d1, ∂h = ξ ∂d1 + ez, ∂d2 = ((x, y, 0) + h ∂h)/d2; m = (x, y)/D: ∂m = (I − m ∂D)/D.
  const Eigen::Vector3d by_h = xi / s->d1 * point + Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d by_d2 = (Eigen::Vector3d(point.x(), point.y(), 0) + s->h * by_h) / s->d2;
  const Eigen::RowVector3d by_denominator = (alpha * by_d2 + (1 - alpha) * by_h).transpose();
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << 1, 0, 0, 0, 1, 0;
  by_point -= point.head<2>() / s->denominator * by_denominator;
  by_point = Eigen::Vector2d(pinhole.fx, pinhole.fy).asDiagonal() * by_point / s->denominator;
  if (!by_point.allFinite()) return std::nullopt;
  return ProjectionWithJacobian{*pixel, by_point};
}

std::optional<Ray> DoubleSphereModel::unproject(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d m((pixel.x() - pinhole.cx) / pinhole.fx, (pixel.y() - pinhole.cy) / pinhole.fy);
  const double square = m.squaredNorm();
  const double under_first = 1 - (2 * alpha - 1) * square;
  if (!m.allFinite() || !(under_first >= 0)) return std::nullopt;
  const double mz = (1 - alpha * alpha * square) / (alpha * std::sqrt(under_first) + 1 - alpha);
  const double under_second = mz * mz + (1 - xi * xi) * square;
  if (!(under_second >= 0)) return std::nullopt;
  const double scale = (mz * xi + std::sqrt(under_second)) / (mz * mz + square);
  const Eigen::Vector3d direction(scale * m.x(), scale * m.y(), scale * mz - xi);
  const Ray ray{Eigen::Vector3d::Zero(), direction.normalized()};
  if (!ray.direction.allFinite() || !spheres_of(*this, ray.direction)) return std::nullopt;
  return ray;
}

}  // namespace spartan
