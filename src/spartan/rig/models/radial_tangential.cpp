#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "spartan/rig/internal/models/polynomial.h"
#include "spartan/rig/models/camera_model.h"

namespace spartan {

using namespace internal;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// With s = r² and c = N/D: d(r c)/dr = c + 2 s dc/ds = (N D + 2 s (N' D − N D')) / D². The map increases from the
// centre to the first zero of that numerator or of D.
double monotonic_limit(const RadialTangentialModel::Coefficients& k) {
  if (!std::all_of(k.begin(), k.end(), [](double v) { return std::isfinite(v); })) return 0;
  const Polynomial n{1, k[0], k[1], k[4]}, d{1, k[5], k[6], k[7]};
  const Polynomial slope_n = product(derivative(n), d), slope_d = product(n, derivative(d));
  Polynomial derivative_numerator = product(n, d);
  for (std::size_t i = 0; i < slope_n.size(); ++i) derivative_numerator[i + 1] += 2 * (slope_n[i] - slope_d[i]);
  // At a radius of 10⁶ a ray is 0.2″ from the image plane: nothing beyond is visible.
  constexpr double kLargestSquare = 1e12;
  double first = kInfinity;
  for (const Polynomial* p : {static_cast<const Polynomial*>(&derivative_numerator), &d}) {
    for (const double root : sign_changes(*p, 0, kLargestSquare)) first = std::min(first, root);
  }
  return std::sqrt(first);
}

// (x', y') of a point of the normalized image plane, with ∂(x', y')/∂(x, y).
struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d jacobian;
};

Distorted distort(const RadialTangentialModel::Coefficients& k, const Eigen::Vector2d& p) {
  const double x = p.x(), y = p.y(), s = p.squaredNorm();
  const double n = 1 + s * (k[0] + s * (k[1] + s * k[4])), d = 1 + s * (k[5] + s * (k[6] + s * k[7]));
  const double dn = k[0] + s * (2 * k[1] + s * 3 * k[4]), dd = k[5] + s * (2 * k[6] + s * 3 * k[7]);
  const double c = n / d, dc = (dn - c * dd) / d;
  const double p1 = k[2], p2 = k[3];
  Distorted result;
  result.point << x * c + 2 * p1 * x * y + p2 * (s + 2 * x * x), y * c + p1 * (s + 2 * y * y) + 2 * p2 * x * y;
  const double mixed = 2 * x * y * dc + 2 * p1 * x + 2 * p2 * y;
  result.jacobian << c + 2 * x * x * dc + 2 * p1 * y + 6 * p2 * x, mixed, mixed,
      c + 2 * y * y * dc + 6 * p1 * y + 2 * p2 * x;
  return result;
}

bool inside(const Distorted& distorted) {
  return distorted.point.allFinite() && distorted.jacobian.determinant() > 0;
}

// Inverse of the radial map r → r c without tangential terms; near the edge of the domain if `target` is out of range.
double undistorted_radius(const RadialTangentialModel& model, double target) {
  const RadialTangentialModel::Coefficients& k = model.coefficients();
  const auto radial = [&](double r) {
    const double s = r * r;
    const double n = 1 + s * (k[0] + s * (k[1] + s * k[4])), d = 1 + s * (k[5] + s * (k[6] + s * k[7]));
    const double dn = k[0] + s * (2 * k[1] + s * 3 * k[4]), dd = k[5] + s * (2 * k[6] + s * 3 * k[7]);
    const double c = n / d;
    return ValueWithDerivative{r * c, c + 2 * s * (dn - c * dd) / d};
  };
  // Tangential terms can map slightly beyond the range of the radial map.
  return solve_increasing(radial, target, 0, model.largest_radius(), target).value_or(0.999 * model.largest_radius());
}

}  // namespace

RadialTangentialModel::RadialTangentialModel(PinholeModel pinhole, Coefficients coefficients)
    : pinhole_(pinhole), coefficients_(coefficients), largest_radius_(monotonic_limit(coefficients)) {}

std::vector<ModelParameterSpec> RadialTangentialModel::parameter_specs() {
  std::vector<ModelParameterSpec> kinds = PinholeModel::parameter_specs();
  kinds.push_back({"distortion", {4, 5, 8}});
  return kinds;
}

ModelParameters RadialTangentialModel::parameters() const {
  ModelParameters lists = pinhole_.parameters();
  const auto is_zero = [](double v) { return v == 0 && !std::signbit(v); };
  std::size_t count = 4;
  if (!is_zero(coefficients_[4])) count = 5;
  if (!std::all_of(coefficients_.begin() + 5, coefficients_.end(), is_zero)) count = 8;
  lists.emplace_back(coefficients_.begin(), coefficients_.begin() + static_cast<std::ptrdiff_t>(count));
  return lists;
}

RadialTangentialModel RadialTangentialModel::from_parameters(const ModelParameters& parameters) {
  Coefficients coefficients{};
  const std::vector<double>& given = parameters.at(2);
  std::copy_n(given.begin(), std::min(given.size(), coefficients.size()), coefficients.begin());
  return {PinholeModel::from_parameters(parameters), coefficients};
}

std::optional<Eigen::Vector2d> RadialTangentialModel::project(const Eigen::Vector3d& point) const {
  if (!(point.z() > 0)) return std::nullopt;
  const Eigen::Vector2d p = point.head<2>() / point.z();
  if (!(p.norm() < largest_radius_)) return std::nullopt;
  const Distorted distorted = distort(coefficients_, p);
  if (!inside(distorted)) return std::nullopt;
  return Eigen::Vector2d(pinhole_.fx * distorted.point.x() + pinhole_.cx,
                         pinhole_.fy * distorted.point.y() + pinhole_.cy);
}

std::optional<ProjectionWithJacobian> RadialTangentialModel::project_with_jacobian(const Eigen::Vector3d& point) const {
  const auto pixel = project(point);
  if (!pixel) return std::nullopt;
  const Eigen::Vector2d p = point.head<2>() / point.z();
  // ∂(u, v)/∂(x', y') · ∂(x', y')/∂(x, y) · ∂(x, y)/∂(X, Y, Z) with x = X/Z, y = Y/Z.
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << 1, 0, -p.x(), 0, 1, -p.y();
  by_point = Eigen::Vector2d(pinhole_.fx, pinhole_.fy).asDiagonal() * distort(coefficients_, p).jacobian * by_point;
  return ProjectionWithJacobian{*pixel, by_point / point.z()};
}

std::optional<Ray> RadialTangentialModel::unproject(const Eigen::Vector2d& pixel) const {
  const Eigen::Vector2d target((pixel.x() - pinhole_.cx) / pinhole_.fx, (pixel.y() - pinhole_.cy) / pinhole_.fy);
  if (!target.allFinite()) return std::nullopt;
  const double tolerance = 1e-12 * (1 + target.norm());
  const double length = target.norm();
  Eigen::Vector2d p = length > 0 ? Eigen::Vector2d(target * (undistorted_radius(*this, length) / length)) : target;
  Distorted distorted = distort(coefficients_, p);
  double error = (distorted.point - target).norm();
  const double rounding = 1e-15 * (1 + length);  // rounding level
  for (int i = 0; i < 50 && error > rounding; ++i) {
    // Step halving: near the edge, where the Jacobian becomes singular, a full step may increase the error.
    Eigen::Vector2d step = distorted.jacobian.inverse() * (target - distorted.point);
    bool improved = false;
    for (int half = 0; half < 30 && !improved; ++half, step *= 0.5) {
      const Distorted next = distort(coefficients_, p + step);
      const double next_error = (next.point - target).norm();
      if (!((p + step).norm() < largest_radius_) || !inside(next) || !(next_error < error)) continue;
      p += step;
      distorted = next;
      error = next_error;
      improved = true;
      break;
    }
    if (!improved) break;
  }
  if (!(error <= tolerance) || !(p.norm() < largest_radius_) || !inside(distorted)) return std::nullopt;
  return Ray{Eigen::Vector3d::Zero(), Eigen::Vector3d(p.x(), p.y(), 1).normalized()};
}

}  // namespace spartan
