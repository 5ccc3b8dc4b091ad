#include "spartan/rig/models/cahvore.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "spartan/rig/models/polynomial.h"

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

// An angle with its sine and cosine.
struct Turn {
  explicit Turn(double a) : angle(a), sine(std::sin(a)), cosine(std::cos(a)) {}
  double angle, sine, cosine;
};

// s(θ) sin θ = (θ − sin θ) E(θ): the way of the entrance pupil, times sin θ, with its derivative.
Slope pupil_of(const CahvoreModel::Entrance& e, const Turn& t) {
  const double s = t.angle * t.angle;
  // θ − sin θ and 1 − cos θ lose their digits near zero.
  const bool small = t.angle < 0.1;
  const double gap =
      small ? t.angle * s * (1 / 6.0 - s * (1 / 120.0 - s * (1 / 5040.0 - s / 362880.0))) : t.angle - t.sine;
  const double gap_slope = small ? s * (1 / 2.0 - s * (1 / 24.0 - s * (1 / 720.0 - s / 40320.0))) : 1 - t.cosine;
  const double polynomial = e[0] + s * (e[1] + s * e[2]), slope = t.angle * (2 * e[1] + 4 * s * e[2]);
  return {gap * polynomial, gap_slope * polynomial + gap * slope};
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

// f = (ω − s) sin θ − |λ| cos θ: by how much the line of sight at the angle misses a point, with ∂f/∂θ.
Slope miss_of(const CahvoreModel::Entrance& e, double omega, double lambda, double angle) {
  const Turn t(angle);
  const Slope pupil = pupil_of(e, t);
  return {omega * t.sine - lambda * t.cosine - pupil.value, omega * t.cosine + lambda * t.sine - pupil.slope};
}

// How far from C neighbouring lines of sight cross, or begin before they cross; zero where they part from each other.
// `pupil_m` is how far the pupil itself is.
struct Crossing {
  double pupil_m, reach_m;
};
Crossing crossing_of(const CahvoreModel::Entrance& e, double angle) {
  const Turn t(angle);
  const Slope pupil = pupil_of(e, t);
  const double way = pupil.value / t.sine, depth = pupil.slope - way * t.cosine;  // s, s' sin θ
  const double begins = std::abs(way);
  if (!(depth > 0)) return {begins, 0};
  return {begins, std::max(begins, std::hypot(way + depth * t.cosine, depth * t.sine))};
}

// The angle at which the pupil or the crossings go far out, and how far off lines of sight cross up to there.
struct Crossings {
  double end, farthest_m;
};
Crossings crossings_of(const CahvoreModel::Entrance& e, double end) {
  if (e == CahvoreModel::Entrance{}) return {end, 0};
  // θ/sin θ goes to infinity at 180°. No lens looks there; the lines of sight there must not spoil the others.
  constexpr double kMuch = 5;
  // The walk finds the farthest crossing to much less than the margin: nothing here turns within a step.
  constexpr int kSteps = 256;
  constexpr double kMargin = 1.01;
  double beside = 0, farthest = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double angle = end * i / kSteps;
    const Crossing crossing = crossing_of(e, angle);
    if (angle <= 0.5 * std::numbers::pi) {
      beside = std::max({beside, crossing.pupil_m, crossing.reach_m});
    } else if (std::max(crossing.pupil_m, crossing.reach_m) > kMuch * beside) {
      end = end * (i - 1) / kSteps;
      break;
    }
    farthest = std::max(farthest, crossing.reach_m);
  }
  return {end, kMargin * farthest};
}

}  // namespace

struct CahvoreModel::Sight {
  Eigen::Vector3d side;  // the direction of λ; anything across the axis where λ is zero
  double omega, lambda;
  double angle;
};

CahvoreModel::CahvoreModel(CahvModel cahv, const Eigen::Vector3d& optical_axis, Radial radial, Entrance entrance_m,
                           double linearity)
    : cahv_(cahv),
      given_axis_(optical_axis),
      axis_(optical_axis.normalized()),
      radial_(radial),
      entrance_(entrance_m),
      linearity_(linearity) {
  const Crossings crossings = crossings_of(entrance_m, angle_where_growth_ends(radial, linearity));
  // The last digits before the end are left to rounding.
  largest_angle_ = crossings.end * (1 - 1e-12);
  nearest_ = crossings.farthest_m;
}

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
  if (!point.allFinite() || !(point.squaredNorm() > nearest_ * nearest_)) return std::nullopt;
  Sight sight{};
  sight.omega = point.dot(axis_);
  const Eigen::Vector3d lambda = point - sight.omega * axis_;
  sight.lambda = lambda.norm();
  if (sight.lambda == 0) {
    sight.side = axis_.unitOrthogonal();
    return sight.omega > 0 ? std::optional(sight) : std::nullopt;  // straight behind, or the camera's own place
  }
  sight.side = lambda / sight.lambda;
  // Outside of `nearest_` f crosses zero once at most, upwards. The pupil moves by millimetres: the angle seen from C
  // is close.
  const auto angle =
      rig_detail::solve_increasing([&](double a) { return miss_of(entrance_, sight.omega, sight.lambda, a); }, 0, 0,
                                   largest_angle_, std::atan2(sight.lambda, sight.omega));
  if (!angle) return std::nullopt;
  sight.angle = *angle;
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
  const double grows = miss_of(entrance_, sight->omega, sight->lambda, sight->angle).slope;
  const Eigen::Matrix3d around = Eigen::Matrix3d::Identity() - axis_ * axis_.transpose() - n * n.transpose();
  const double across = sight->lambda > 0 ? bent.value / sight->lambda : bent.slope / grows;
  const Eigen::RowVector3d by_angle = (std::cos(sight->angle) * n - std::sin(sight->angle) * axis_).transpose() / grows;
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
                                                  largest_angle_, std::atan(radius));
  if (!angle) return std::nullopt;
  const Turn t(*angle);
  const double way = t.sine > 0 ? pupil_of(entrance_, t).value / t.sine : 0;
  return Ray{way * axis_, (t.cosine * axis_ + t.sine / radius * lambda).normalized()};
}

}  // namespace spartan
