#include "spartan/reconstruction/map_generator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "spartan/numerics/connected_components.h"

namespace spartan {
namespace {

constexpr float kNoHeight = std::numeric_limits<float>::quiet_NaN();
constexpr double kLeastSigma_m = 0.001;  // lower bound of a point's vertical standard deviation; empirical
constexpr float kMostLogodds = 5;        // saturation of a cell's log-odds: a probability of 0.993
constexpr double kCut_rad = 0.5 * std::numbers::pi / 180;  // height of the margin at the upper edge of the view

// Sums over the points of a cell.
struct Cell {
  double weights = 0, sum = 0;
  float lowest = std::numeric_limits<float>::infinity(), highest = -std::numeric_limits<float>::infinity();
  int count = 0, ground = 0;
  bool truncated = false;
};

struct Grid {
  GeoTransform place;
  int width = 0, height = 0;
  std::vector<Cell> cells;
  const Cell& at(int x, int y) const {
    return cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  Cell& at(int x, int y) {
    return cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
};

Grid make_grid(const MapOptions& options, const Eigen::Vector3d& middle) {
  Grid grid;
  const double half = 0.5 * options.extent_m, cell = options.cell_m;
  grid.place = {std::floor((middle.x() - half) / cell) * cell, std::ceil((middle.y() + half) / cell) * cell, cell};
  grid.width = grid.height = static_cast<int>(std::ceil(options.extent_m / cell));
  grid.cells.resize(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height));
  return grid;
}

void rasterize_points(std::span<const SurfacePoint> points, const Pose& map_from_body, Grid& grid) {
  const Eigen::Matrix3f rotation = map_from_body.rotation_matrix().cast<float>();
  const Eigen::Vector3f translation = map_from_body.translation().cast<float>();
  for (const SurfacePoint& point : points) {
    const Eigen::Vector3f p = rotation * point.in_body + translation;
    const GridCell at = cell_at(grid.place, p.x(), p.y());
    if (at.column < 0 || at.row < 0 || at.column >= grid.width || at.row >= grid.height) continue;
    const double sigma =
        std::max(std::abs(static_cast<double>(rotation.row(2).dot(point.ray)) * point.sigma_m), kLeastSigma_m);
    Cell& cell = grid.at(at.column, at.row);
    const double weight = 1 / (sigma * sigma);
    cell.weights += weight;
    cell.sum += weight * p.z();
    cell.lowest = std::min(cell.lowest, p.z());
    cell.highest = std::max(cell.highest, p.z());
    ++cell.count;
    cell.truncated = cell.truncated || point.truncated;
    cell.ground += point.kind == GroundClass::ground ? 1 : 0;
  }
}

void classify(const MapOptions& options, const Grid& grid, LocalMap& map) {
  const auto [w, h] = map.size();
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      // Without a ground surface nothing is over or under it: the cell stays unknown, its log-odds 0.
      if (!(map.count(x, y) > 0) || !std::isfinite(map.ground_m(x, y))) continue;
      const double height_above = map.elevation_max_m(x, y) - map.ground_m(x, y),
                   depth_below = map.ground_m(x, y) - map.elevation_min_m(x, y);
      const double sigma = std::sqrt(static_cast<double>(map.variance_m2(x, y))) + kLeastSigma_m;
      const double obstacle_m = options.obstacle_m * (grid.at(x, y).truncated ? options.truncated_obstacle_factor : 1);
      map.kind(x, y) = GroundClass::ground;
      if (height_above > obstacle_m) {
        map.kind(x, y) = GroundClass::obstacle;
      } else if (depth_below > options.cavity_m) {
        map.kind(x, y) = GroundClass::cavity;
      }
      // Log-odds of p = Φ((height − threshold) / σ), where Φ(x) ≈ 1 / (1 + exp(−1.702 x)) within 0.01.
      const double excess = std::max(height_above - obstacle_m, depth_below - options.cavity_m) / sigma;
      map.occupancy_logodds(x, y) = std::clamp(static_cast<float>(1.702 * excess), -kMostLogodds, kMostLogodds);
    }
  }
}

// Obstacles are the 8-connected components of obstacle cells.
void list_obstacles(LocalMap& map) {
  const auto [w, h] = map.size();
  Image<std::uint8_t> mask(w, h);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) mask(x, y) = map.kind(x, y) == GroundClass::obstacle ? 1 : 0;
  }
  for (const std::vector<PixelIndex>& cells : connected_components(mask)) {
    Eigen::Vector2d low = cell_centre(map.place, cells.front().x, cells.front().y), high = low;
    Obstacle obstacle;
    obstacle.cells = static_cast<int>(cells.size());
    for (const auto [x, y] : cells) {
      const Eigen::Vector2d at = cell_centre(map.place, x, y);
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
      obstacle.height_m =
          std::max(obstacle.height_m, static_cast<double>(map.elevation_max_m(x, y) - map.ground_m(x, y)));
    }
    obstacle.middle_m = 0.5 * (low + high);
    obstacle.width_m = high.x() - low.x() + map.place.cell_m;
    obstacle.length_m = high.y() - low.y() + map.place.cell_m;
    map.obstacles.push_back(obstacle);
  }
}

}  // namespace

std::vector<SurfacePoint> surface_points(const MergedRange& merged) {
  std::vector<SurfacePoint> points;
  const Eigen::Matrix3d rotation = merged.body_from_centre.rotation_matrix();
  const int edge = std::max(1, static_cast<int>(std::lround(kCut_rad * merged.camera.per_radian())));
  std::vector<int> tops(static_cast<std::size_t>(merged.range_m.width()), merged.range_m.height());
  for (int y = 0; y < merged.range_m.height(); ++y) {
    for (int x = 0; x < merged.range_m.width(); ++x) {
      const float range = merged.range_m(x, y);
      if (!std::isfinite(range)) continue;
      int& top = tops[static_cast<std::size_t>(x)];
      top = std::min(top, y);
      const Eigen::Vector3d ray = rotation * merged.camera.direction(x, y);
      const Eigen::Vector3d place = merged.body_from_centre.translation() + static_cast<double>(range) * ray;
      points.push_back({place.cast<float>(), merged.sigma_m(x, y), ray.cast<float>(),
                        static_cast<GroundClass>(merged.classes(x, y)), y < top + edge});
    }
  }
  return points;
}

Result<MapGenerator> MapGenerator::create(const MapOptions& options, ThreadPool workers) {
  if (Status valid = validate(options, "map options"); !valid) return failure(valid);
  return MapGenerator(options, std::move(workers));
}

LocalMap MapGenerator::generate(std::span<const SurfacePoint> points, const Pose& map_from_body) const {
  Grid grid = make_grid(options_, map_from_body.translation());
  rasterize_points(points, map_from_body, grid);
  LocalMap map;
  map.map_from_body = map_from_body;
  map.place = grid.place;
  const int w = grid.width, h = grid.height;
  for (Image<float>* layer :
       {&map.elevation_m, &map.elevation_min_m, &map.elevation_max_m, &map.variance_m2, &map.ground_m})
    *layer = Image<float>(w, h, kNoHeight);
  for (Image<float>* layer : {&map.count, &map.occupancy_logodds}) *layer = Image<float>(w, h, 0.0F);
  map.kind = Image<GroundClass>(w, h);
  Image<std::uint8_t> is_ground(w, h);
  bool any_ground = false;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const Cell& cell = grid.at(x, y);
      if (cell.count < options_.min_points) continue;
      map.elevation_m(x, y) = static_cast<float>(cell.sum / cell.weights);
      map.elevation_min_m(x, y) = cell.lowest;
      map.elevation_max_m(x, y) = cell.highest;
      map.count(x, y) = static_cast<float>(cell.count);
      // Errors of a cell's points are correlated (disparities are smooth), so the variance of their mean is that of
      // one.
      map.variance_m2(x, y) = static_cast<float>(cell.count / cell.weights);
      is_ground(x, y) = 2 * cell.ground > cell.count ? 1 : 0;
      any_ground = any_ground || is_ground(x, y) != 0;
    }
  }
  if (!any_ground) {
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x) is_ground(x, y) = map.count(x, y) > 0 ? 1 : 0;
    }
  }
  map.ground_m = fit_ground(map.elevation_m, is_ground, options_.cell_m, options_.ground, workers_);
  classify(options_, grid, map);
  Traversability shape = compute_traversability(
      {map.elevation_m, map.elevation_max_m, map.ground_m, map.kind, map.place.cell_m}, options_.rover, workers_);
  map.slope_rad = std::move(shape.slope_rad);
  map.roughness_m = std::move(shape.roughness_m);
  map.step_m = std::move(shape.step_m);
  map.cost = std::move(shape.cost);
  list_obstacles(map);
  return map;
}

}  // namespace spartan
