#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "spartan/reconstruction/map_generator.h"

namespace spartan {
namespace {

constexpr int kMinCells = 5;  // known cells of the neighbourhood that a plane is fitted to

// Normal equations of the plane z = p0 x + p1 y + p2 around a cell, and the elevation range of the 3×3 cells.
struct Neighbourhood {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squares = 0;
  float low, high;

  explicit Neighbourhood(float z) : low(z), high(z) {}

  void add(int dx, int dy, double cell_m, float z) {
    const Eigen::Vector3d row(dx * cell_m, -dy * cell_m, 1);
    normal += row * row.transpose();
    right += static_cast<double>(z) * row;
    squares += static_cast<double>(z) * z;
    if (std::abs(dx) <= 1 && std::abs(dy) <= 1) {
      low = std::min(low, z);
      high = std::max(high, z);
    }
  }
  bool determines_plane() const { return normal(2, 2) >= kMinCells && normal.determinant() >= 1e-9; }
};

Neighbourhood neighbourhood_of(ImageView<const float> z, int x, int y, int radius, double cell_m) {
  Neighbourhood neighbourhood(z(x, y));
  for (int j = std::max(y - radius, 0); j <= std::min(y + radius, z.height() - 1); ++j) {
    for (int i = std::max(x - radius, 0); i <= std::min(x + radius, z.width() - 1); ++i) {
      if (std::isfinite(z(i, j))) neighbourhood.add(i - x, j - y, cell_m, z(i, j));
    }
  }
  return neighbourhood;
}

}  // namespace

Traversability compute_traversability(const TerrainSurface& s, const RoverLimits& rover, const ThreadPool& workers) {
  const int w = s.elevation_m.width(), h = s.elevation_m.height();
  constexpr float kUnknownShape = std::numeric_limits<float>::quiet_NaN();
  Traversability shape{Image<float>(w, h, kUnknownShape), Image<float>(w, h, kUnknownShape),
                       Image<float>(w, h, kUnknownShape), Image<float>(w, h, kUnknownShape)};
  const int radius = std::max(1, static_cast<int>(std::lround(0.25 * rover.geometry.track_m / s.cell_m)));
  const double steepest = rover.max_slope_deg * std::numbers::pi / 180;
  workers.parallel_for(0, h, 16, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      for (int x = 0; x < w; ++x) {
        if (!std::isfinite(s.elevation_m(x, y))) continue;
        const Neighbourhood neighbourhood = neighbourhood_of(s.elevation_m, x, y, radius, s.cell_m);
        shape.step_m(x, y) = neighbourhood.high - neighbourhood.low;
        if (!neighbourhood.determines_plane()) continue;
        const Eigen::Vector3d plane = neighbourhood.normal.ldlt().solve(neighbourhood.right);
        shape.slope_rad(x, y) = static_cast<float>(std::atan(std::hypot(plane.x(), plane.y())));
        shape.roughness_m(x, y) = static_cast<float>(std::sqrt(
            std::max(0.0, neighbourhood.squares - neighbourhood.right.dot(plane)) / neighbourhood.normal(2, 2)));
        const double worst = std::max({shape.slope_rad(x, y) / steepest, shape.step_m(x, y) / rover.max_step_m,
                                       shape.roughness_m(x, y) / (0.5 * rover.geometry.wheel_radius_m),
                                       (s.elevation_max_m(x, y) - s.ground_m(x, y)) / rover.geometry.clearance_m,
                                       s.kind(x, y) == GroundClass::cavity ? 1.0 : 0.0});
        shape.cost(x, y) = static_cast<float>(std::clamp(worst, 0.0, 1.0));
      }
    }
  });
  return shape;
}

}  // namespace spartan
