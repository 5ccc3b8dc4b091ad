#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "spartan/rig/internal/models/cahvor_radial.h"
#include "spartan/rig/internal/models/polynomial.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

using namespace internal;

namespace {

// χ(θ) with dχ/dθ.
ValueWithDerivative chi_of(double linearity, double angle) {
  const double scaled = linearity * angle;
  if (linearity > 0) return {std::tan(scaled) / linearity, 1 / (std::cos(scaled) * std::cos(scaled))};
  if (linearity < 0) return {std::sin(scaled) / linearity, std::cos(scaled)};
  return {angle, 1};
}

// b(θ) = χ (1 + μ(χ)) with db/dθ: the tangent of the off-axis angle after distortion.
ValueWithDerivative distorted_radius(const CahvoreModel::Radial& r, double linearity, double angle) {
  const ValueWithDerivative chi = chi_of(linearity, angle);
  const double s = chi.value * chi.value;
  return {chi.value * (1 + r[0] + s * (r[1] + s * r[2])), (1 + r[0] + s * (3 * r[1] + s * 5 * r[2])) * chi.derivative};
}

// An angle with its sine and cosine.
struct Angle {
  explicit Angle(double a) : angle(a), sine(std::sin(a)), cosine(std::cos(a)) {}
  double angle, sine, cosine;
};

// s(θ) sin θ = (θ − sin θ) E(θ): the offset of the entrance pupil times sin θ, with its derivative by θ.
ValueWithDerivative pupil_of(const CahvoreModel::Entrance& e, const Angle& t) {
  const double s = t.angle * t.angle;
  // θ − sin θ and 1 − cos θ lose digits by cancellation near zero: below 0.1 rad their Taylor series are used.
  const bool small = t.angle < 0.1;
  const double gap =
      small ? t.angle * s * (1 / 6.0 - s * (1 / 120.0 - s * (1 / 5040.0 - s / 362880.0))) : t.angle - t.sine;
  const double gap_slope = small ? s * (1 / 2.0 - s * (1 / 24.0 - s * (1 / 720.0 - s / 40320.0))) : 1 - t.cosine;
  const double polynomial = e[0] + s * (e[1] + s * e[2]), slope = t.angle * (2 * e[1] + 4 * s * e[2]);
  return {gap * polynomial, gap_slope * polynomial + gap * slope};
}

// The smallest angle at which χ (1 + μ) stops increasing, or where χ is no longer defined.
double monotonic_limit(const CahvoreModel::Radial& r, double linearity) {
  double end = std::numbers::pi;
  if (linearity != 0) end = std::min(end, 0.5 * std::numbers::pi / std::abs(linearity));
  const double chi = cahvor_monotonic_limit(r);
  if (linearity > 0) return std::min(end, std::atan(chi * linearity) / linearity);
  if (linearity < 0) return chi * -linearity < 1 ? std::asin(chi * -linearity) / -linearity : end;
  return std::min(end, chi);
}

// f(θ) = (ω − s) sin θ − |λ| cos θ with ∂f/∂θ: the signed distance of a point from the ray of angle θ.
ValueWithDerivative ray_distance(const CahvoreModel::Entrance& e, double omega, double lambda, double angle) {
  const Angle t(angle);
  const ValueWithDerivative pupil = pupil_of(e, t);
  return {omega * t.sine - lambda * t.cosine - pupil.value, omega * t.cosine + lambda * t.sine - pupil.derivative};
}

// The intersection of neighbouring rays at an angle: the distance of the pupil from C, and the largest distance from C
// of the ray segment between pupil and intersection; `reach_m` is 0 if neighbouring rays diverge.
struct RayIntersection {
  double pupil_m, reach_m;
};
RayIntersection ray_intersection(const CahvoreModel::Entrance& e, double angle) {
  const Angle t(angle);
  const ValueWithDerivative pupil = pupil_of(e, t);
  const double offset = pupil.value / t.sine, depth = pupil.derivative - offset * t.cosine;  // s, s' sin θ
  const double pupil_distance = std::abs(offset);
  if (!(depth > 0)) return {pupil_distance, 0};
  return {pupil_distance, std::max(pupil_distance, std::hypot(offset + depth * t.cosine, depth * t.sine))};
}

// The angle at which the pupil or the ray intersections diverge, and the largest distance of an intersection from C
// below that angle.
struct IntersectionLimits {
  double end, farthest_m;
};
IntersectionLimits intersection_limits(const CahvoreModel::Entrance& e, double end) {
  if (e == CahvoreModel::Entrance{}) return {end, 0};
  // θ/sin θ diverges at 180°, where no lens images anything. The domain ends where a distance exceeds this multiple of
  // the largest one within 90° (empirical), so that such rays do not exclude near points for all other rays.
  constexpr double kDivergence = 5;
  // All functions vary slowly over one step, so sampling finds the farthest intersection to much less than the margin.
  constexpr int kSteps = 256;
  constexpr double kMargin = 1.01;  // on the largest distance
  double within_90_deg = 0, farthest = 0;
  for (int i = 1; i <= kSteps; ++i) {
    const double angle = end * i / kSteps;
    const RayIntersection crossing = ray_intersection(e, angle);
    if (angle <= 0.5 * std::numbers::pi) {
      within_90_deg = std::max({within_90_deg, crossing.pupil_m, crossing.reach_m});
    } else if (std::max(crossing.pupil_m, crossing.reach_m) > kDivergence * within_90_deg) {
      end = end * (i - 1) / kSteps;
      break;
    }
    farthest = std::max(farthest, crossing.reach_m);
  }
  return {end, kMargin * farthest};
}

}  // namespace

struct CahvoreModel::AxialPoint {
  Eigen::Vector3d side;  // the direction of λ; any direction perpendicular to the axis if λ is zero
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
  const IntersectionLimits limits = intersection_limits(entrance_m, monotonic_limit(radial, linearity));
  // A margin for rounding at the end of the domain.
  largest_angle_ = limits.end * (1 - 1e-12);
  nearest_ = limits.farthest_m;
}

std::vector<ModelParameterSpec> CahvoreModel::parameter_specs() {
  std::vector<ModelParameterSpec> kinds = CahvorModel::parameter_specs();
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

std::optional<CahvoreModel::AxialPoint> CahvoreModel::axial_point_of(const Eigen::Vector3d& point) const {
  if (!point.allFinite() || !(point.squaredNorm() > nearest_ * nearest_)) return std::nullopt;
  AxialPoint axial{};
  axial.omega = point.dot(axis_);
  const Eigen::Vector3d lambda = point - axial.omega * axis_;
  axial.lambda = lambda.norm();
  if (axial.lambda == 0) {
    axial.side = axis_.unitOrthogonal();
    return axial.omega > 0 ? std::optional(axial) : std::nullopt;  // on the axis behind the camera, or at C
  }
  axial.side = lambda / axial.lambda;
  // Beyond `nearest_` f has at most one zero and increases there. The pupil moves by millimetres, so the angle at C is
  // a good initial value.
  const auto angle = solve_increasing([&](double a) { return ray_distance(entrance_, axial.omega, axial.lambda, a); },
                                      0, 0, largest_angle_, std::atan2(axial.lambda, axial.omega));
  if (!angle) return std::nullopt;
  axial.angle = *angle;
  return axial;
}

// P' is scaled by χ/|λ|: O + b λ/|λ|, which is defined on the axis too.
std::optional<Eigen::Vector2d> CahvoreModel::project(const Eigen::Vector3d& point) const {
  const auto axial = axial_point_of(point);
  if (!axial) return std::nullopt;
  return cahv_.project(axis_ + distorted_radius(radial_, linearity_, axial->angle).value * axial->side);
}

std::optional<ProjectionWithJacobian> CahvoreModel::project_with_jacobian(const Eigen::Vector3d& point) const {
  const auto axial = axial_point_of(point);
  if (!axial) return std::nullopt;
  const ValueWithDerivative distorted = distorted_radius(radial_, linearity_, axial->angle);
  auto result = cahv_.project_with_jacobian(axis_ + distorted.value * axial->side);
  if (!result) return std::nullopt;
  // P'' = O + b(θ) n with n = λ/|λ|: ∂n = (I − O Oᵀ − n nᵀ)/|λ|, and by the implicit function theorem with g = ∂f/∂θ
  // ∂θ/∂ω = −sin θ/g, ∂θ/∂|λ| = cos θ/g. On the axis b/|λ| → b'/g.
  const Eigen::Vector3d& n = axial->side;
  const double df_dangle = ray_distance(entrance_, axial->omega, axial->lambda, axial->angle).derivative;
  const Eigen::Matrix3d around = Eigen::Matrix3d::Identity() - axis_ * axis_.transpose() - n * n.transpose();
  const double across = axial->lambda > 0 ? distorted.value / axial->lambda : distorted.derivative / df_dangle;
  const Eigen::RowVector3d by_angle =
      (std::cos(axial->angle) * n - std::sin(axial->angle) * axis_).transpose() / df_dangle;
  result->by_point = (result->by_point * (across * around + distorted.derivative * n * by_angle)).eval();
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
  const auto angle = solve_increasing([&](double a) { return distorted_radius(radial_, linearity_, a); }, radius, 0,
                                      largest_angle_, std::atan(radius));
  if (!angle) return std::nullopt;
  const Angle t(*angle);
  const double offset = t.sine > 0 ? pupil_of(entrance_, t).value / t.sine : 0;
  return Ray{offset * axis_, (t.cosine * axis_ + t.sine / radius * lambda).normalized()};
}

}  // namespace spartan
