#include "spartan/sim/internal/camera/sky_light.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace spartan::sim::internal {
namespace {

// Empirical constants; sky_light_test.cpp compares the result with ray casting.
constexpr double kMargin_m = 1;          // rocks within this distance outside the region occlude the sky, too
constexpr double kFarStep_m = 0.25;      // grid spacing of the surrounding ground
constexpr double kFar_m = 20;            // extent of the surrounding ground
constexpr int kSide = 2;                 // each cell samples kSide² heights of the scene
constexpr double kAbove_m = 20;          // height above the origin from which vertical rays start
constexpr float kUnderneath = 0.4F;      // view factor below an overhang over that on top of it
constexpr float kSameHeight_m = 0.005F;  // grid points whose height differs by more from a point get less weight

// Mean heights on a grid, relative to the scene's origin; cell (i, j) is centred at (x0 + i step, y0 + j step).
// `tops` are the highest samples of each cell, which occlude the sky for other cells.
struct HeightGrid {
  double x0, y0, step;
  Image<float> heights;
  Image<float> tops = {};
};

// The scene from above by vertical rays, the mean of kSide² samples per cell.
HeightGrid rasterize_heights(const GroundScene& scene, const Region& region, double step, const ThreadPool& workers) {
  HeightGrid grid{region.x0, region.y0, step,
                  Image<float>(static_cast<int>((region.x1 - region.x0) / step) + 2,
                               static_cast<int>((region.y1 - region.y0) / step) + 2)};
  const auto [nx, ny] = grid.heights.size();
  grid.tops = Image<float>(nx, ny);
  static_assert(kPacket % (kSide * kSide) == 0);
  constexpr int kCells = kPacket / (kSide * kSide);
  workers.parallel_for(0, ny, 16, [&](int from, int to) {
    for (int j = from; j < to; ++j) {
      for (int first = 0; first < nx; first += kCells) {
        RayPacket rays;
        for (int k = 0; k < kPacket; ++k) {
          const int i = first + k / (kSide * kSide), a = k % kSide, b = k / kSide % kSide;
          const double x = grid.x0 + step * (i + (a + 0.5) / kSide - 0.5),
                       y = grid.y0 + step * (j + (b + 0.5) / kSide - 0.5);
          const Eigen::Vector3d above(x - scene.origin().x(), y - scene.origin().y(), kAbove_m);
          rays.set(k, above.cast<float>(), -Eigen::Vector3f::UnitZ(), 2 * kAbove_m);
        }
        const HitPacket hits = scene.intersect(rays);
        for (int cell = 0; cell < kCells && first + cell < nx; ++cell) {
          float sum = 0, top = -static_cast<float>(kAbove_m);
          for (int k = 0; k < kSide * kSide; ++k) {
            const float depth = std::min(hits.distance[cell * kSide * kSide + k], static_cast<float>(2 * kAbove_m));
            sum += static_cast<float>(kAbove_m) - depth;
            top = std::max(top, static_cast<float>(kAbove_m) - depth);
          }
          grid.heights(first + cell, j) = sum / (kSide * kSide);
          grid.tops(first + cell, j) = top;
        }
      }
    }
  });
  return grid;
}

HeightGrid rasterize_terrain(const TerrainShape& shape, const GroundScene& scene, const Region& region,
                             const ThreadPool& workers) {
  HeightGrid grid{region.x0, region.y0, kFarStep_m,
                  Image<float>(static_cast<int>((region.x1 - region.x0) / kFarStep_m) + 2,
                               static_cast<int>((region.y1 - region.y0) / kFarStep_m) + 2)};
  workers.parallel_for(0, grid.heights.height(), 4, [&](int from, int to) {
    for (int j = from; j < to; ++j) {
      for (int i = 0; i < grid.heights.width(); ++i) {
        grid.heights(i, j) =
            static_cast<float>(shape.height(grid.x0 + i * kFarStep_m, grid.y0 + j * kFarStep_m) - scene.origin().z());
      }
    }
  });
  grid.tops = grid.heights.clone();
  return grid;
}

// Slope (tangent of the elevation) of the horizon at every point of a grid, in the direction (cos, sin) of an azimuth.
// Sweeps each line of the grid from its far end and keeps the visible points ahead as an upper convex hull on a stack.
class HorizonSweep {
 public:
  HorizonSweep(const HeightGrid& grid, double azimuth)
      : grid_(grid), along_x_(std::abs(std::cos(azimuth)) >= std::abs(std::sin(azimuth))) {
    const double c = std::cos(azimuth), s = std::sin(azimuth);
    forwards_ = (along_x_ ? c : s) > 0;
    drift_ = along_x_ ? s / c : c / s;
    step_length_ = grid.step * std::sqrt(1 + drift_ * drift_);
    major_ = along_x_ ? grid.heights.width() : grid.heights.height();
    minor_ = along_x_ ? grid.heights.height() : grid.heights.width();
  }

  Image<float> slopes(const ThreadPool& workers) const {
    Image<float> result(grid_.heights.width(), grid_.heights.height(), 0.0F);
    const double total = drift_ * (major_ - 1);
    const int first = static_cast<int>(std::floor(std::min(0.0, -total))) - 1;
    const int last = minor_ + static_cast<int>(std::ceil(std::max(0.0, -total))) + 1;
    workers.parallel_for(first, last, 64, [&](int from, int to) {
      std::vector<Point> hull;
      for (int line = from; line < to; ++line) sweep_line(line, hull, result);
    });
    return result;
  }

 private:
  struct Point {
    double at, height;
  };

  double height_at(const Image<float>& heights, int along, double across) const {
    const int low = std::clamp(static_cast<int>(std::floor(across)), 0, minor_ - 1),
              high = std::min(low + 1, minor_ - 1);
    const double part = std::clamp(across - low, 0.0, 1.0);
    const auto at = [&](int m) { return static_cast<double>(along_x_ ? heights(along, m) : heights(m, along)); };
    return at(low) + part * (at(high) - at(low));
  }

  void sweep_line(int line, std::vector<Point>& hull, Image<float>& result) const {
    hull.clear();
    for (int step = 0; step < major_; ++step) {
      const int along = forwards_ ? major_ - 1 - step : step;
      const double across = line + drift_ * along;
      const int cell = static_cast<int>(std::floor(across + 0.5));
      if (cell < 0 || cell >= minor_) continue;
      const Point here{-step_length_ * step, height_at(grid_.heights, along, across)};
      const auto slope = [&](const Point& p) { return (p.height - here.height) / (p.at - here.at); };
      while (hull.size() >= 2 && slope(hull[hull.size() - 2]) >= slope(hull.back())) hull.pop_back();
      const auto horizon = static_cast<float>(hull.empty() ? 0.0 : std::max(slope(hull.back()), 0.0));
      (along_x_ ? result(along, cell) : result(cell, along)) = horizon;
      hull.push_back({here.at, height_at(grid_.tops, along, across)});
    }
  }

  const HeightGrid& grid_;
  bool along_x_, forwards_ = true;
  double drift_ = 0, step_length_ = 0;
  int major_ = 0, minor_ = 0;
};

float interpolated(const Image<float>& image, double u, double v) {
  const int i = std::clamp(static_cast<int>(u), 0, image.width() - 2),
            j = std::clamp(static_cast<int>(v), 0, image.height() - 2);
  const auto a = static_cast<float>(u - i), b = static_cast<float>(v - j);
  return (1 - b) * ((1 - a) * image(i, j) + a * image(i + 1, j)) +
         b * ((1 - a) * image(i, j + 1) + a * image(i + 1, j + 1));
}

// The smaller of the one-sided slopes: a rock does not tilt the ground beside it.
double min_slope(double before, double here, double after, double step) {
  const double down = (here - before) / step, up = (after - here) / step;
  return std::abs(down) < std::abs(up) ? down : up;
}

Eigen::Vector3d normal_at(const HeightGrid& grid, int i, int j) {
  const Image<float>& z = grid.heights;
  const int i0 = std::max(i - 1, 0), i1 = std::min(i + 1, z.width() - 1), j0 = std::max(j - 1, 0),
            j1 = std::min(j + 1, z.height() - 1);
  return Eigen::Vector3d(-min_slope(z(i0, j), z(i, j), z(i1, j), grid.step),
                         -min_slope(z(i, j0), z(i, j), z(i, j1), grid.step), 1)
      .normalized();
}

// Irradiance by the sky in one azimuth above a horizon of the given slope, on a plane of normal n (class comment); the
// integral over all azimuths is π for open level ground.
double sky_irradiance(double azimuth_cos, double azimuth_sin, double slope, const Eigen::Vector3d& n) {
  const double towards = n.x() * azimuth_cos + n.y() * azimuth_sin;
  const double own = -towards / std::max(n.z(), 1e-3);  // horizon by the plane itself
  const double t = std::max({slope, own, 0.0}), h = std::atan(t), cos2 = 1 / (1 + t * t);
  return 0.5 * (n.z() * cos2 + towards * (std::numbers::pi / 2 - h - t * cos2));
}

}  // namespace

SkyLight::SkyLight(const GroundScene& scene, const TerrainShape& shape, const ThreadPool& workers)
    : region_(scene.region().grown(kMargin_m)) {
  HeightGrid near = rasterize_heights(scene, region_, kStep_m, workers);
  const HeightGrid far = rasterize_terrain(shape, scene, scene.region().grown(kFar_m), workers);
  const auto [nx, ny] = near.heights.size();
  relative_view_factor_ = Image<float>(nx, ny, 0.0F);
  for (int k = 0; k < kAzimuths; ++k) {
    const double azimuth = 2 * std::numbers::pi * (k + 0.5) / kAzimuths, c = std::cos(azimuth), s = std::sin(azimuth);
    const Image<float> near_slopes = HorizonSweep(near, azimuth).slopes(workers);
    const Image<float> far_slopes = HorizonSweep(far, azimuth).slopes(workers);
    workers.parallel_for(0, ny, 16, [&](int from, int to) {
      for (int j = from; j < to; ++j) {
        const double v = (near.y0 + j * kStep_m - far.y0) / kFarStep_m;
        for (int i = 0; i < nx; ++i) {
          const double u = (near.x0 + i * kStep_m - far.x0) / kFarStep_m;
          const float slope = std::max(near_slopes(i, j), interpolated(far_slopes, u, v));
          relative_view_factor_(i, j) +=
              static_cast<float>(sky_irradiance(c, s, slope, normal_at(near, i, j)) * 2 / kAzimuths);
        }
      }
    });
  }
  workers.parallel_for(0, ny, 16, [&](int from, int to) {
    for (int j = from; j < to; ++j) {
      for (int i = 0; i < nx; ++i)
        relative_view_factor_(i, j) /= static_cast<float>(0.5 * (1 + normal_at(near, i, j).z()));
    }
  });
  heights_ = std::move(near.heights);
  base_m_ = scene.origin().z();
}

float SkyLight::view_factor(const Eigen::Vector3d& point, float normal_z) const {
  const float tilted = 0.5F * (1 + normal_z);
  const double u = (point.x() - region_.x0) / kStep_m, v = (point.y() - region_.y0) / kStep_m;
  if (!(u >= 0) || !(v >= 0) || u >= relative_view_factor_.width() - 1 || v >= relative_view_factor_.height() - 1)
    return tilted;
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const auto a = static_cast<float>(u - i), b = static_cast<float>(v - j);
  const auto height = static_cast<float>(point.z() - base_m_);
  float sum = 0, weights = 0, lowest = 1e9F;
  for (int k = 0; k < 4; ++k) {
    const int x = i + (k & 1), y = j + (k >> 1);
    const float off = (heights_(x, y) - height) / kSameHeight_m;
    lowest = std::min(lowest, off);
    const float weight = ((k & 1) != 0 ? a : 1 - a) * ((k >> 1) != 0 ? b : 1 - b) / (1 + off * off) + 1e-6F;
    sum += weight * relative_view_factor_(x, y);
    weights += weight;
  }
  const float under = lowest > 2 ? kUnderneath : 1.0F;
  return under * tilted * sum / weights;
}

}  // namespace spartan::sim::internal
