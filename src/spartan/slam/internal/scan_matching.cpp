#include "spartan/slam/internal/scan_matching.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>

namespace spartan::internal {
namespace {

constexpr double kNone = 2;       // cost of a pose with too little overlap; costs are at most 1
constexpr int kFewestCells = 40;  // minimum overlap of a pose, cells of twice the map's cell size; empirical

// A cell of the local map, relative to the centre of rotation.
struct LocalCell {
  float x, y, z, variance, occupancy;
};

std::vector<LocalCell> cells_of(const SurfaceGrid& grid, const Eigen::Vector3d& centre) {
  std::vector<LocalCell> cells;
  const GeoTransform place = grid.window.place(grid.cell_m);
  for (int r = 0; r < grid.window.height; ++r) {
    for (int c = 0; c < grid.window.width; ++c) {
      if (!std::isfinite(grid.elevation_m(c, r))) continue;
      const Eigen::Vector2d at = cell_centre(place, c, r) - centre.head<2>();
      cells.push_back({static_cast<float>(at.x()), static_cast<float>(at.y()),
                       static_cast<float>(grid.elevation_m(c, r) - centre.z()), grid.variance_m2(c, r),
                       grid.occupancy(c, r)});
    }
  }
  return cells;
}

// A local cell with the global elevation at its position: d is the elevation difference.
struct Pair {
  float x, y, d, variance, disagreement;
};

// Look-up of the global map: elevations are interpolated bilinearly, relative to the centre of rotation; variance and
// occupancy are those of the nearest cell.
class GlobalSurface {
 public:
  GlobalSurface(const SurfaceGrid& grid, const Eigen::Vector3d& centre)
      : grid_(grid),
        u0_(centre.x() / grid.cell_m - grid.window.west - 0.5),
        v0_(grid.window.north - centre.y() / grid.cell_m - 0.5),
        z0_(static_cast<float>(centre.z())),
        per_m_(1 / grid.cell_m) {}

  // Adds the pair of a local cell at (x, y) relative to the centre; nothing where the global elevation is unknown.
  void add_pair(const LocalCell& cell, double x, double y, std::vector<Pair>& pairs) const {
    const double u = u0_ + x * per_m_, v = v0_ - y * per_m_;
    if (!(u >= 0 && v >= 0 && u < grid_.window.width - 1 && v < grid_.window.height - 1)) return;
    const int c = static_cast<int>(u), r = static_cast<int>(v);
    const float a = static_cast<float>(u - c), b = static_cast<float>(v - r);
    const float *above = grid_.elevation_m.row(r) + c, *below = grid_.elevation_m.row(r + 1) + c;
    const float z = (1 - b) * ((1 - a) * above[0] + a * above[1]) + b * ((1 - a) * below[0] + a * below[1]);
    if (!(z == z)) return;
    const int nearest_c = c + (a > 0.5F ? 1 : 0), nearest_r = r + (b > 0.5F ? 1 : 0);
    pairs.push_back({static_cast<float>(x), static_cast<float>(y), cell.z - (z - z0_),
                     cell.variance + grid_.variance_m2(nearest_c, nearest_r),
                     0.5F * (1 - cell.occupancy * grid_.occupancy(nearest_c, nearest_r))});
  }

 private:
  const SurfaceGrid& grid_;
  double u0_, v0_;
  float z0_;
  double per_m_;
};

// Fits d ≈ p₀ + p₁ x + p₂ y with the Geman-McClure weights of the residuals from the previous plane.
Eigen::Vector3d fit_plane(const std::vector<Pair>& pairs, const Eigen::Vector3d& before, double scale_m) {
  Eigen::Matrix3d m = Eigen::Matrix3d::Identity() * 1e-9;
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  for (const Pair& pair : pairs) {
    const Eigen::Vector3d row(1, pair.x, pair.y);
    const double r = pair.d - before.dot(row), s2 = scale_m * scale_m + pair.variance, k = 1 / (1 + r * r / s2);
    const double w = k * k / s2;
    m += w * row * row.transpose();
    v += (w * pair.d) * row;
  }
  return m.ldlt().solve(v);
}

double cost_of(const std::vector<Pair>& pairs, const Eigen::Vector3d& plane, const MatchOptions& options) {
  double sum = 0;
  const double scale2 = options.elevation_scale_m * options.elevation_scale_m;
  for (const Pair& pair : pairs) {
    const double r = pair.d - plane[0] - plane[1] * pair.x - plane[2] * pair.y, u2 = r * r / (scale2 + pair.variance);
    sum += u2 / (1 + u2) + options.class_weight * pair.disagreement;
  }
  return sum / (static_cast<double>(pairs.size()) * (1 + options.class_weight));
}

struct Trial {
  double cost = kNone;
  Eigen::Vector3d plane = Eigen::Vector3d::Zero();
};

int steps(double half, double step) {
  return std::max(1, static_cast<int>(std::ceil(half / step - 1e-9)));
}

// Rotation about the centre by yaw, then translation, then height and tilt that bring the fitted plane to zero.
Pose correction_of(const Eigen::Vector3d& centre, double dx, double dy, double yaw, const Eigen::Vector3d& plane) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  // (θ × q)_z = θ_x q_y − θ_y q_x must be −(p₁ q_x + p₂ q_y).
  const Eigen::Quaterniond tilt = exp_so3({-plane[2], plane[1], 0});
  return Pose::from_translation(centre) * Pose::from_rotation(tilt) * Pose(turn, Eigen::Vector3d(dx, dy, -plane[0])) *
         Pose::from_translation(-centre);
}

}  // namespace

SearchWindow search_window(const UncertainPose& world_from_body, const MatchOptions& options) {
  const Eigen::Matrix3d turn = world_from_body.pose.rotation_matrix();
  const Eigen::Matrix3d place = turn * world_from_body.covariance.topLeftCorner<3, 3>() * turn.transpose(),
                        attitude = turn * world_from_body.covariance.bottomRightCorner<3, 3>() * turn.transpose();
  const double degree = std::numbers::pi / 180;
  const auto half = [&](double variance, double step, double widest) {
    return std::clamp(options.window_sigmas * std::sqrt(std::max(variance, 0.0)), std::min(step, widest), widest);
  };
  return {half(place(0, 0), options.step_m, options.max_search_m),
          half(place(1, 1), options.step_m, options.max_search_m),
          half(attitude(2, 2), options.step_deg * degree, options.max_search_deg * degree)};
}

std::vector<ScanMatchPeak> correlative_scan_match(const SurfaceGrid& local, const SurfaceGrid& global,
                                                  const Eigen::Vector3d& centre, const SearchWindow& window,
                                                  const MatchOptions& options, const ThreadPool& workers) {
  const std::vector<LocalCell> cells = cells_of(local, centre);
  const GlobalSurface ground(global, centre);
  const double yaw_step = options.step_deg * std::numbers::pi / 180;
  const int nx = steps(window.x_m, options.step_m), ny = steps(window.y_m, options.step_m),
            na = steps(window.yaw_rad, yaw_step);
  const int x_count = 2 * nx + 1, y_count = 2 * ny + 1, yaw_count = 2 * na + 1;
  const std::int64_t count = std::int64_t{x_count} * y_count * yaw_count;
  if (static_cast<double>(count) > MatchOptions::kMostTrials)
    throw std::invalid_argument("correlative_scan_match: the window exceeds MatchOptions::kMostTrials");

  // Approximate height and tilt, so that the robust fits start within their basin of convergence.
  std::vector<Pair> pairs;
  for (const LocalCell& cell : cells) ground.add_pair(cell, cell.x, cell.y, pairs);
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  for (const double scale : {10.0, 0.3, 0.1, 0.1}) start = fit_plane(pairs, start, scale);

  std::vector<Trial> trials(static_cast<std::size_t>(count));
  const auto at = [&](int a, int j, int i) -> Trial& {
    return trials[static_cast<std::size_t>((a * y_count + j) * x_count + i)];
  };
  workers.parallel_for(0, yaw_count, 1, [&](int from, int to) {
    std::vector<Pair> pairs_here;
    for (int a = from; a < to; ++a) {
      const double yaw = (a - na) * yaw_step, cosine = std::cos(yaw), sine = std::sin(yaw);
      for (int j = 0; j < y_count; ++j) {
        for (int i = 0; i < x_count; ++i) {
          const double dx = (i - nx) * options.step_m, dy = (j - ny) * options.step_m;
          pairs_here.clear();
          for (const LocalCell& cell : cells) {
            ground.add_pair(cell, cosine * cell.x - sine * cell.y + dx, sine * cell.x + cosine * cell.y + dy,
                            pairs_here);
          }
          if (pairs_here.size() < kFewestCells) continue;
          Trial& trial = at(a, j, i);
          trial.plane = fit_plane(pairs_here, start, 4 * options.elevation_scale_m);
          trial.plane = fit_plane(pairs_here, trial.plane, options.elevation_scale_m);
          trial.cost = cost_of(pairs_here, trial.plane, options);
        }
      }
    }
  });

  std::vector<ScanMatchPeak> peaks;
  for (int a = 0; a < yaw_count; ++a) {
    for (int j = 0; j < y_count; ++j) {
      for (int i = 0; i < x_count; ++i) {
        const Trial& here = at(a, j, i);
        bool lowest = here.cost < kNone;
        for (int b = std::max(a - 1, 0); b <= std::min(a + 1, yaw_count - 1) && lowest; ++b) {
          for (int l = std::max(j - 1, 0); l <= std::min(j + 1, y_count - 1) && lowest; ++l) {
            for (int k = std::max(i - 1, 0); k <= std::min(i + 1, x_count - 1) && lowest; ++k)
              lowest = at(b, l, k).cost >= here.cost;
          }
        }
        if (!lowest) continue;
        const bool edge = a == 0 || j == 0 || i == 0 || a == yaw_count - 1 || j == y_count - 1 || i == x_count - 1;
        peaks.push_back({correction_of(centre, (i - nx) * options.step_m, (j - ny) * options.step_m,
                                       (a - na) * yaw_step, here.plane),
                         here.cost, edge});
      }
    }
  }
  std::stable_sort(peaks.begin(), peaks.end(),
                   [](const ScanMatchPeak& a, const ScanMatchPeak& b) { return a.cost < b.cost; });
  return peaks;
}

}  // namespace spartan::internal
