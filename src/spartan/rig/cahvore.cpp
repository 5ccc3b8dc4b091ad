#include "spartan/rig/cahvore.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "spartan/rig/polynomial.h"

namespace spartan {
namespace {

using rig_detail::Slope;

// χ(θ).
Slope chi_of(double linearity, double angle) {
  const double turned = linearity * angle;
  if (linearity > 0) return {std::tan(turned) / linearity, 1 / (std::cos(turned) * std::cos(turned))};
  if (linearity < 0) return {std::sin(turned) / linearity, std::cos(turned)};
  return {angle, 1};
}

// χ (1 + μ(χ)) by θ: the tangent of the angle that the light has behind the lens.
Slope bent_of(const CahvoreModel::Radial& r, double linearity, double angle) {
  const Slope chi = chi_of(linearity, angle);
  const double s = chi.value * chi.value;
  return {chi.value * (1 + r[0] + s * (r[1] + s * r[2])), (1 + r[0] + s * (3 * r[1] + s * 5 * r[2])) * chi.slope};
}

// s(θ) sin θ = (θ − sin θ) E(θ): the way of the entrance pupil, times sin θ, with its derivative.
Slope pupil_of(const CahvoreModel::Entrance& e, double angle) {
  const double s = angle * angle;
  // θ − sin θ loses its digits near zero.
  const double gap =
      angle < 0.1 ? angle * s * (1 / 6.0 - s * (1 / 120.0 - s * (1 / 5040.0 - s / 362880.0))) : angle - std::sin(angle);
  const double polynomial = e[0] + s * (e[1] + s * e[2]), slope = angle * (2 * e[1] + 4 * s * e[2]);
  const double half = std::sin(0.5 * angle);
  return {gap * polynomial, 2 * half * half * polynomial + gap * slope};
}

// The smallest angle at which χ (1 + μ) no longer grows, or χ has its own end.
double angle_where_growth_ends(const CahvoreModel::Radial& r, double linearity) {
  double end = std::numbers::pi;
  if (linearity != 0) end = std::min(end, 0.5 * std::numbers::pi / std::abs(linearity));
  const double chi = rig_detail::cahvor_growth_end(r);
  if (linearity > 0) return std::min(end, std::atan(chi * linearity) / linearity);
  if (linearity < 0) return chi * -linearity < 1 ? std::asin(chi * -linearity) / -linearity : end;
  return std::min(end, chi);
}

}  // namespace

struct CahvoreModel::Sight {
  Eigen::Vector3d side;  // the direction of λ; anything across the axis where λ is zero
  double omega, lambda;
  double angle;
  double grows;  // ∂/∂θ of (ω − s) sin θ − |λ| cos θ, above zero
};

CahvoreModel::CahvoreModel(CahvModel cahv, const Eigen::Vector3d& optical_axis, Radial radial, Entrance entrance_m,
                           double linearity)
    : cahv_(cahv),
      given_axis_(optical_axis),
      axis_(optical_axis.normalized()),
      radial_(radial),
      entrance_(entrance_m),
      linearity_(linearity),
      largest_angle_(angle_where_growth_ends(radial, linearity)) {}

std::vector<ModelParameterKind> CahvoreModel::parameter_kinds() {
  std::vector<ModelParameterKind> kinds = CahvorModel::parameter_kinds();
  kinds.push_back({"entrance_m", {3}});
  kinds.push_back({.key = "linearity", .counts = {1}, .least = -1, .most = 1});
  return kinds;
}

ModelParameters CahvoreModel::parameters() const {
  ModelParameters lists = CahvorModel(cahv_, given_axis_, radial_).parameters();
  lists.emplace_back(entrance_.begin(), entrance_.end());
  lists.push_back({linearity_});
  return lists;
}

CahvoreModel CahvoreModel::from_parameters(const ModelParameters& parameters) {
  const CahvorModel plain = CahvorModel::from_parameters(parameters);
  const std::vector<double>& e = parameters.at(5);
  return {plain.cahv(), plain.optical_axis(), plain.radial(), {e.at(0), e.at(1), e.at(2)}, parameters.at(6).at(0)};
}

std::optional<CahvoreModel::Sight> CahvoreModel::sight_of(const Eigen::Vector3d& point) const {
  if (!point.allFinite()) return std::nullopt;
  Sight sight{};
  sight.omega = point.dot(axis_);
  const Eigen::Vector3d lambda = point - sight.omega * axis_;
  sight.lambda = lambda.norm();
  if (sight.lambda == 0 && sight.omega <= 0) return std::nullopt;  // straight behind, or the camera's own place
  sight.side = sight.lambda > 0 ? Eigen::Vector3d(lambda / sight.lambda) : axis_.unitOrthogonal();
  // Newton's method from the angle seen from C; the pupil moves by millimetres, so a few steps do.
  double angle = std::atan2(sight.lambda, sight.omega);
  for (int i = 0; i < 100; ++i) {
    const double sine = std::sin(angle), cosine = std::cos(angle);
    const Slope pupil = pupil_of(entrance_, angle);
    const double value = sight.omega * sine - sight.lambda * cosine - pupil.value;
    sight.grows = sight.omega * cosine + sight.lambda * sine - pupil.slope;
    if (!(sight.grows > 0)) return std::nullopt;
    const double next = angle - value / sight.grows;
    const bool settled = std::abs(next - angle) <= 1e-15 * std::max(1e-3, std::abs(next));
    angle = next;
    if (!(angle >= 0 && angle < largest_angle_)) return std::nullopt;
    if (settled) break;
  }
  sight.angle = angle;
  return sight;
}

// P' is taken per χ/|λ|: O + (bent/|λ|) λ, which exists on the axis too.
std::optional<Eigen::Vector2d> CahvoreModel::project(const Eigen::Vector3d& point) const {
  const auto sight = sight_of(point);
  if (!sight) return std::nullopt;
  return cahv_.project(axis_ + bent_of(radial_, linearity_, sight->angle).value * sight->side);
}

std::optional<ProjectionWithJacobian> CahvoreModel::project_with_jacobian(const Eigen::Vector3d& point) const {
  const auto sight = sight_of(point);
  if (!sight) return std::nullopt;
  const Slope bent = bent_of(radial_, linearity_, sight->angle);
  auto result = cahv_.project_with_jacobian(axis_ + bent.value * sight->side);
  if (!result) return std::nullopt;
  // P'' = O + b(θ) n with n = λ/|λ|: ∂n = (I − O Oᵀ − n nᵀ)/|λ|, and by the implicit equation of θ
  // ∂θ/∂ω = −sin θ/g, ∂θ/∂|λ| = cos θ/g. On the axis b/|λ| → b'/g.
  const Eigen::Vector3d& n = sight->side;
  const Eigen::Matrix3d around = Eigen::Matrix3d::Identity() - axis_ * axis_.transpose() - n * n.transpose();
  const double across = sight->lambda > 0 ? bent.value / sight->lambda : bent.slope / sight->grows;
  const Eigen::RowVector3d by_angle =
      (std::cos(sight->angle) * n - std::sin(sight->angle) * axis_).transpose() / sight->grows;
  result->by_point = (result->by_point * (across * around + bent.slope * n * by_angle)).eval();
  if (!result->by_point.allFinite()) return std::nullopt;
  return result;
}

std::optional<Ray> CahvoreModel::unproject(const Eigen::Vector2d& pixel) const {
  const auto linear = cahv_.unproject(pixel);
  if (!linear) return std::nullopt;
  const double omega = linear->direction.dot(axis_);
  if (!(omega > 0)) return std::nullopt;
  const Eigen::Vector3d lambda = (linear->direction - omega * axis_) / omega;
  const double radius = lambda.norm();
  if (radius == 0) return Ray{Eigen::Vector3d::Zero(), axis_};
  const auto angle = rig_detail::solve_increasing([&](double a) { return bent_of(radial_, linearity_, a); }, radius, 0,
                                                  largest_angle_ * (1 - 1e-12), std::atan(radius));
  if (!angle) return std::nullopt;
  const double sine = std::sin(*angle);
  const double way = sine > 0 ? pupil_of(entrance_, *angle).value / sine : 0;
  return Ray{way * axis_, (std::cos(*angle) * axis_ + sine / radius * lambda).normalized()};
}

}  // namespace spartan
