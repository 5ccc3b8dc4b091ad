#include <algorithm>
#include <cmath>
#include <numbers>

#include "spartan/rig/internal/models/polynomial.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

using namespace internal;

namespace {

using Coefficients = EquidistantModel::Coefficients;

// ρ(θ) with dρ/dθ.
ValueWithDerivative image_radius(const Coefficients& k, double angle) {
  const double s = angle * angle;
  return {angle * (1 + s * (k[0] + s * (k[1] + s * (k[2] + s * k[3])))),
          1 + s * (3 * k[0] + s * (5 * k[1] + s * (7 * k[2] + s * 9 * k[3])))};
}

double monotonic_limit(const Coefficients& k) {
  if (!std::all_of(k.begin(), k.end(), [](double v) { return std::isfinite(v); })) return 0;
  const Polynomial derivative{1, 3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3]};  // dρ/dθ as a polynomial in θ²
  const auto ends = sign_changes(derivative, 0, std::numbers::pi * std::numbers::pi);
  return ends.empty() ? std::numbers::pi : std::sqrt(ends.front());
}

}  // namespace

EquidistantModel::EquidistantModel(PinholeModel pinhole, Coefficients coefficients)
    : pinhole_(pinhole), coefficients_(coefficients), largest_angle_(monotonic_limit(coefficients)) {}

std::vector<ModelParameterSpec> EquidistantModel::parameter_specs() {
  std::vector<ModelParameterSpec> kinds = PinholeModel::parameter_specs();
  kinds.push_back({"distortion", {4}});
  return kinds;
}

ModelParameters EquidistantModel::parameters() const {
  ModelParameters lists = pinhole_.parameters();
  lists.emplace_back(coefficients_.begin(), coefficients_.end());
  return lists;
}

EquidistantModel EquidistantModel::from_parameters(const ModelParameters& parameters) {
  Coefficients coefficients{};
  std::copy_n(parameters.at(2).begin(), std::min(parameters.at(2).size(), coefficients.size()), coefficients.begin());
  return {PinholeModel::from_parameters(parameters), coefficients};
}

std::optional<Eigen::Vector2d> EquidistantModel::project(const Eigen::Vector3d& point) const {
  const double side = point.head<2>().norm();
  const double angle = std::atan2(side, point.z());
  if (!point.allFinite() || !(angle < largest_angle_)) return std::nullopt;
  if (side == 0 && point.z() <= 0) return std::nullopt;  // the projection centre
  // ρ/side → 1/z as the point approaches the axis.
  const double scale = side > 0 ? image_radius(coefficients_, angle).value / side : 1 / point.z();
  const Eigen::Vector2d pixel(pinhole_.fx * (scale * point.x()) + pinhole_.cx,
                              pinhole_.fy * (scale * point.y()) + pinhole_.cy);
  if (!pixel.allFinite()) return std::nullopt;
  return pixel;
}

std::optional<ProjectionWithJacobian> EquidistantModel::project_with_jacobian(const Eigen::Vector3d& point) const {
  const auto pixel = project(point);
  if (!pixel) return std::nullopt;
  const double x = point.x(), y = point.y(), z = point.z();
  const double side = std::hypot(x, y), square = point.squaredNorm();
  Eigen::Matrix<double, 2, 3> by_point;
  if (side > 0) {
    // m = ρ(θ) (x, y)/side with ∂θ/∂side = z/|p|², ∂θ/∂z = −side/|p|².
    const ValueWithDerivative rho = image_radius(coefficients_, std::atan2(side, z));
    const double cosine = x / side, sine = y / side, across = rho.value / side, along = rho.derivative * z / square;
    by_point << across * sine * sine + along * cosine * cosine, (along - across) * sine * cosine,
        -rho.derivative * side / square * cosine, (along - across) * sine * cosine,
        across * cosine * cosine + along * sine * sine, -rho.derivative * side / square * sine;
  } else {
    by_point << 1 / z, 0, 0, 0, 1 / z, 0;
  }
  by_point = Eigen::Vector2d(pinhole_.fx, pinhole_.fy).asDiagonal() * by_point;
  if (!by_point.allFinite()) return std::nullopt;
  return ProjectionWithJacobian{*pixel, by_point};
}

std::optional<Ray> EquidistantModel::unproject(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d target((pixel.x() - pinhole_.cx) / pinhole_.fx, (pixel.y() - pinhole_.cy) / pinhole_.fy);
  if (!target.allFinite()) return std::nullopt;
  const double radius = target.norm();
  if (radius == 0) return Ray{};
  const auto angle =
      solve_increasing([&](double a) { return image_radius(coefficients_, a); }, radius, 0, largest_angle_, radius);
  if (!angle || !(*angle < largest_angle_)) return std::nullopt;
  const Eigen::Vector2d side = target * (std::sin(*angle) / radius);
  return Ray{Eigen::Vector3d::Zero(), Eigen::Vector3d(side.x(), side.y(), std::cos(*angle)).normalized()};
}

}  // namespace spartan
