#include "spartan/slam/internal/map_refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace spartan::internal {
namespace {

// All empirical.
constexpr int kMaxIterations = 20;
constexpr double kConverged_m = 5e-4, kConverged_rad = 3e-4;  // step sizes at convergence
constexpr double kMinDrop_m = 0.05;                           // vertical distance from the camera to a cell
constexpr double kMinInflation_m = 0.002, kMinScale = 0.1;  // inflation below which it becomes 0; least residual scale
constexpr double kDamping = 1e-6;  // relative damping of the diagonal: directions without slope do not move

int known_cells(const Image<float>& elevation_m) {
  int known = 0;
  for (int y = 0; y < elevation_m.height(); ++y) {
    for (int x = 0; x < elevation_m.width(); ++x) known += std::isfinite(elevation_m(x, y)) ? 1 : 0;
  }
  return known;
}

}  // namespace

Vector6d elevation_jacobian(const Eigen::Vector2d& slope, const Eigen::Vector3d& from_centre) {
  const Eigen::Vector3d n(-slope.x(), -slope.y(), 1);
  Vector6d j;
  j << n, from_centre.cross(n);
  return j;
}

Pose moved(const Pose& world_from_body, const Eigen::Vector3d& centre, const Vector6d& tangent) {
  return Pose::from_translation(centre + tangent.head<3>()) * Pose::from_rotation(exp_so3(tangent.tail<3>())) *
         Pose::from_translation(-centre) * world_from_body;
}

std::vector<MatchedCell> matched_cells(const SurfaceGrid& local, const SurfaceGrid& global, const Viewpoint& from,
                                       const ResidualScale& scale, const MatchOptions& options) {
  std::vector<MatchedCell> cells;
  const GeoTransform place = global.window.place(global.cell_m);
  const double k2 = options.robust_sigmas * options.robust_sigmas,
               rough2 = options.relief_sigma_ratio * options.relief_sigma_ratio;
  for (int r = 0; r < global.window.height; ++r) {
    for (int c = 0; c < global.window.width; ++c) {
      const float zl = local.elevation_m(c, r), zg = global.elevation_m(c, r);
      if (!std::isfinite(zl) || !std::isfinite(zg)) continue;
      const Eigen::Vector2f jacobian_by_local = local.slope(c, r), jacobian_by_global = global.slope(c, r);
      if (!jacobian_by_local.allFinite() || !jacobian_by_global.allFinite()) continue;
      MatchedCell cell{c, r, static_cast<double>(zl) - zg};
      const double relief2 = static_cast<double>(local.relief_m(c, r)) * local.relief_m(c, r) +
                             static_cast<double>(global.relief_m(c, r)) * global.relief_m(c, r);
      const double variance =
          static_cast<double>(local.variance_m2(c, r)) + global.variance_m2(c, r) + rough2 * relief2;
      cell.sigma_m = std::sqrt(variance);
      const double s2 = scale.scale * scale.scale * variance + scale.inflation_m * scale.inflation_m,
                   u2 = cell.residual_m * cell.residual_m / (k2 * s2), robust = 1 / (1 + u2);
      cell.weight = robust * robust / s2;
      cell.curvature = cell.weight * (1 - 3 * u2) * robust;
      const Eigen::Vector2d at = cell_centre(place, c, r);
      const Eigen::Vector3d place_m(at.x(), at.y(), 0.5 * (zl + zg));
      cell.jacobian_by_local = elevation_jacobian(jacobian_by_local.cast<double>(), place_m - from.body);
      cell.jacobian_by_global = elevation_jacobian(jacobian_by_global.cast<double>(), place_m - from.body);
      // Change of the elevation at a fixed position when the surface moves along the ray by σ / |a_z|.
      const Eigen::Vector3d ray = place_m - from.camera;
      const double noise = std::sqrt(static_cast<double>(local.variance_m2(c, r)) + global.variance_m2(c, r));
      const double range_noise = noise / std::max(std::abs(ray.z()), kMinDrop_m);
      const Vector6d j = cell.jacobian();
      cell.common_error_m = range_noise * j.head<3>().dot(ray);
      cell.relief_error_m = range_noise * j.head<2>().dot(ray.head<2>());
      cells.push_back(cell);
    }
  }
  return cells;
}

Eigen::Vector3d ray_origin_of(std::span<const SurfacePoint> points) {
  Eigen::Matrix3d m = Eigen::Matrix3d::Identity() * 1e-9;
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points.size(); i += std::max<std::size_t>(1, points.size() / 1000)) {
    const Eigen::Vector3d ray = points[i].ray.cast<double>();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray * ray.transpose();
    m += across;
    v += across * points[i].in_body.cast<double>();
  }
  return m.ldlt().solve(v);
}

double median_normalized_residual(std::span<const MatchedCell> cells) {
  std::vector<double> ratios;
  ratios.reserve(cells.size());
  for (const MatchedCell& cell : cells) ratios.push_back(std::abs(cell.residual_m) / cell.sigma_m);
  if (ratios.empty()) return 0;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle / 0.6745;
}

std::vector<SurfacePoint> downsampled(std::span<const SurfacePoint> points, double side_m) {
  struct Sum {
    Eigen::Vector3d place = Eigen::Vector3d::Zero(), ray = Eigen::Vector3d::Zero();
    double variance = 0;
    int count = 0;
    GroundClass kind = GroundClass::unknown;
  };
  if (points.empty()) return {};
  Eigen::Vector2f low = points.front().in_body.head<2>(), high = low;
  for (const SurfacePoint& p : points) {
    low = low.cwiseMin(p.in_body.head<2>());
    high = high.cwiseMax(p.in_body.head<2>());
  }
  const auto per_m = static_cast<float>(1 / side_m);
  const auto cell_of = [&](const Eigen::Vector3f& p, int axis) {
    return static_cast<std::size_t>((p[axis] - low[axis]) * per_m);
  };
  const std::size_t width = static_cast<std::size_t>((high.x() - low.x()) * per_m) + 1,
                    height = static_cast<std::size_t>((high.y() - low.y()) * per_m) + 1;
  std::vector<Sum> sums(width * height);
  for (const SurfacePoint& p : points) {
    Sum& sum = sums[cell_of(p.in_body, 1) * width + cell_of(p.in_body, 0)];
    sum.place += p.in_body.cast<double>();
    sum.ray += p.ray.cast<double>();
    sum.variance += static_cast<double>(p.sigma_m) * p.sigma_m;
    ++sum.count;
    sum.kind = p.kind;
  }
  std::vector<SurfacePoint> means;
  for (const Sum& sum : sums) {
    if (sum.count == 0) continue;
    means.push_back({(sum.place / sum.count).cast<float>(), static_cast<float>(std::sqrt(sum.variance / sum.count)),
                     sum.ray.normalized().cast<float>(), sum.kind});
  }
  return means;
}

std::optional<RefinedMatch> refine_match(std::span<const SurfacePoint> points, const SurfaceGrid& global,
                                         const Pose& world_from_body, int min_points, const MatchOptions& options) {
  RefinedMatch match;
  match.world_from_body = world_from_body;
  const Eigen::Vector3d camera = ray_origin_of(points);
  ResidualScale scale{options.elevation_scale_m, 1};
  for (; match.iterations < kMaxIterations; ++match.iterations) {
    const SurfaceGrid local = rasterize(points, match.world_from_body, global.window, global.cell_m, min_points);
    const Viewpoint from{match.world_from_body.translation(), match.world_from_body * camera};
    match.cells = matched_cells(local, global, from, scale, options);
    if (static_cast<int>(match.cells.size()) < options.min_cells) return std::nullopt;
    match.normalized_residual = median_normalized_residual(match.cells);
    if (match.converged || match.iterations + 1 == kMaxIterations) match.known_cells = known_cells(local.elevation_m);
    if (match.converged) break;  // after the cells have been computed at the final pose
    Matrix6d normal = Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();
    for (const MatchedCell& cell : match.cells) {
      const Vector6d j = cell.jacobian();
      normal += cell.weight * j * j.transpose();
      gradient += (cell.weight * cell.residual_m) * j;
    }
    normal.diagonal() *= 1 + kDamping;
    const Vector6d step = -normal.ldlt().solve(gradient);
    if (!step.allFinite()) return std::nullopt;
    match.world_from_body = moved(match.world_from_body, from.body, step);
    match.converged =
        scale.inflation_m == 0 && step.head<3>().norm() < kConverged_m && step.tail<3>().norm() < kConverged_rad;
    if (!match.converged) {
      if (scale.inflation_m == 0) scale.scale = std::clamp(match.normalized_residual, kMinScale, 1.0);
      scale.inflation_m = scale.inflation_m > kMinInflation_m ? 0.5 * scale.inflation_m : 0;
    }
  }
  return match;
}

}  // namespace spartan::internal
