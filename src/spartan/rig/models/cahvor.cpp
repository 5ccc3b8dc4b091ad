#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "spartan/rig/internal/models/cahvor_radial.h"
#include "spartan/rig/internal/models/polynomial.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

using namespace internal;

namespace {

// μ(τ) with dμ/dτ.
ValueWithDerivative mu_of(const CahvorModel::Radial& r, double tau) {
  return {r[0] + tau * (r[1] + tau * r[2]), r[1] + 2 * tau * r[2]};
}

}  // namespace

double internal::cahvor_monotonic_limit(const CahvorModel::Radial& r) {
  if (!std::all_of(r.begin(), r.end(), [](double v) { return std::isfinite(v); }) || !(1 + r[0] > 0)) return 0;
  // At a radius of 10⁶ a ray is 0.2″ from the image plane: nothing beyond is visible.
  constexpr double kLargestSquare = 1e12;
  const auto ends = sign_changes({1 + r[0], 3 * r[1], 5 * r[2]}, 0, kLargestSquare);
  return ends.empty() ? std::numeric_limits<double>::infinity() : std::sqrt(ends.front());
}

CahvorModel::CahvorModel(CahvModel cahv, const Eigen::Vector3d& optical_axis, Radial radial)
    : cahv_(cahv),
      given_axis_(optical_axis),
      axis_(optical_axis.normalized()),
      radial_(radial),
      largest_radius_(cahvor_monotonic_limit(radial)) {}

std::vector<ModelParameterSpec> CahvorModel::parameter_specs() {
  std::vector<ModelParameterSpec> kinds = CahvModel::parameter_specs();
  kinds.push_back({.key = "optical_axis", .counts = {3}, .unit_length = true});
  kinds.push_back({"radial", {3}});
  return kinds;
}

ModelParameters CahvorModel::parameters() const {
  ModelParameters lists = cahv_.parameters();
  lists.push_back({given_axis_.x(), given_axis_.y(), given_axis_.z()});
  lists.emplace_back(radial_.begin(), radial_.end());
  return lists;
}

CahvorModel CahvorModel::from_parameters(const ModelParameters& parameters) {
  const std::vector<double>&o = parameters.at(3), &r = parameters.at(4);
  return {
      CahvModel::from_parameters(parameters), Eigen::Vector3d(o.at(0), o.at(1), o.at(2)), {r.at(0), r.at(1), r.at(2)}};
}

std::optional<Eigen::Vector2d> CahvorModel::project(const Eigen::Vector3d& point) const {
  const double omega = point.dot(axis_);
  if (!(omega > 0)) return std::nullopt;
  const Eigen::Vector3d lambda = point - omega * axis_;
  const double tau = lambda.squaredNorm() / (omega * omega);
  if (!(tau < largest_radius_ * largest_radius_)) return std::nullopt;
  return cahv_.project(point + mu_of(radial_, tau).value * lambda);
}

std::optional<ProjectionWithJacobian> CahvorModel::project_with_jacobian(const Eigen::Vector3d& point) const {
  if (!project(point)) return std::nullopt;
  const double omega = point.dot(axis_);
  const Eigen::Vector3d lambda = point - omega * axis_;
  const double tau = lambda.squaredNorm() / (omega * omega);
  const ValueWithDerivative mu = mu_of(radial_, tau);
  // ∂λ = I − O Oᵀ, ∂τ = 2 (λ − τ ω O)/ω², ∂P' = I + μ ∂λ + λ μ' ∂τ.
  const Eigen::Matrix3d perpendicular = Eigen::Matrix3d::Identity() - axis_ * axis_.transpose();
  const Eigen::RowVector3d by_tau = 2 / (omega * omega) * (lambda - tau * omega * axis_).transpose();
  const Eigen::Matrix3d by_point =
      Eigen::Matrix3d::Identity() + mu.value * perpendicular + mu.derivative * lambda * by_tau;
  auto result = cahv_.project_with_jacobian(point + mu.value * lambda);
  if (result) result->by_point = (result->by_point * by_point).eval();
  if (result && !result->by_point.allFinite()) return std::nullopt;
  return result;
}

std::optional<Ray> CahvorModel::unproject(const Eigen::Vector2d& pixel) const {
  const auto linear = cahv_.unproject(pixel);
  if (!linear) return std::nullopt;
  // λ' = (1 + μ) λ is perpendicular to O: the azimuth about O is known, x = √τ is the only unknown.
  const double omega = linear->direction.dot(axis_);
  if (!(omega > 0)) return std::nullopt;
  const Eigen::Vector3d side = (linear->direction - omega * axis_) / omega;
  const double radius = side.norm();
  if (radius == 0) return Ray{Eigen::Vector3d::Zero(), axis_};
  const auto radial = [&](double x) {
    const ValueWithDerivative mu = mu_of(radial_, x * x);
    return ValueWithDerivative{x * (1 + mu.value), 1 + mu.value + 2 * x * x * mu.derivative};
  };
  const auto x = solve_increasing(radial, radius, 0, largest_radius_, radius);
  if (!x || !(*x < largest_radius_)) return std::nullopt;
  return Ray{Eigen::Vector3d::Zero(), (axis_ + side * (*x / radius)).normalized()};
}

}  // namespace spartan
