#include "spartan/reconstruction/terrain_shape.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace spartan {
namespace {

constexpr int kFewestCells = 5;  // around, for a plane

// z = p0 x + p1 y + p2 around a cell, by least squares, and the steps to the cells beside it.
struct Surroundings {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squares = 0;
  float low, high;

  explicit Surroundings(float z) : low(z), high(z) {}

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
  bool make_a_plane() const { return normal(2, 2) >= kFewestCells && normal.determinant() >= 1e-9; }
};

Surroundings look_around(ImageView<const float> z, int x, int y, int reach, double cell_m) {
  Surroundings around(z(x, y));
  for (int j = std::max(y - reach, 0); j <= std::min(y + reach, z.height() - 1); ++j) {
    for (int i = std::max(x - reach, 0); i <= std::min(x + reach, z.width() - 1); ++i) {
      if (std::isfinite(z(i, j))) around.add(i - x, j - y, cell_m, z(i, j));
    }
  }
  return around;
}

}  // namespace

TerrainShape measure_shape(const TerrainSurface& s, const RoverLimits& rover, const Workers& workers) {
  const int w = s.elevation_m.width(), h = s.elevation_m.height();
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  TerrainShape shape{Image<float>(w, h, kNaN), Image<float>(w, h, kNaN), Image<float>(w, h, kNaN),
                     Image<float>(w, h, kNaN)};
  const int reach = std::max(1, static_cast<int>(std::lround(0.25 * rover.track_m / s.cell_m)));
  const double steepest = rover.steepest_deg * std::numbers::pi / 180;
  workers.for_each_part(0, h, 16, [&](int first, int last) {
    for (int y = first; y < last; ++y) {
      for (int x = 0; x < w; ++x) {
        if (!std::isfinite(s.elevation_m(x, y))) continue;
        const Surroundings around = look_around(s.elevation_m, x, y, reach, s.cell_m);
        shape.step_m(x, y) = around.high - around.low;
        if (!around.make_a_plane()) continue;
        const Eigen::Vector3d plane = around.normal.ldlt().solve(around.right);
        shape.slope_rad(x, y) = static_cast<float>(std::atan(std::hypot(plane.x(), plane.y())));
        shape.roughness_m(x, y) = static_cast<float>(
            std::sqrt(std::max(0.0, around.squares - around.right.dot(plane)) / around.normal(2, 2)));
        const double worst =
            std::max({shape.slope_rad(x, y) / steepest, shape.step_m(x, y) / rover.highest_step_m,
                      shape.roughness_m(x, y) / (0.5 * rover.wheel_radius_m),
                      (s.elevation_max_m(x, y) - s.ground_m(x, y)) / rover.clearance_m, s.kind(x, y) == 3 ? 1.0 : 0.0});
        shape.cost(x, y) = static_cast<float>(std::clamp(worst, 0.0, 1.0));
      }
    }
  });
  return shape;
}

}  // namespace spartan
