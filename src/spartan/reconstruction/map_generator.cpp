#include "spartan/reconstruction/map_generator.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "spartan/numerics/connected_components.h"
#include "spartan/reconstruction/internal/calibration_variance.h"
#include "spartan/reconstruction/internal/cell_support.h"

namespace spartan {
namespace {

constexpr float kNoHeight = std::numeric_limits<float>::quiet_NaN();
constexpr double kLeastSigma_m = 0.001;  // lower bound of a point's vertical standard deviation; empirical
constexpr float kMostLogodds = 5;        // saturation of a cell's log-odds: a probability of 0.993

constexpr double kOpening = 1.0 / 3;  // of the ground's window: larger pits are part of the ground surface; empirical
constexpr double kSupportGap = 3;     // in cell sizes: groups of cells stand apart by more than this; empirical

// What the points of a cell say.
struct Cell {
  double weights = 0;                // of all points
  double used_weights = 0, sum = 0;  // of the points between the trimmed ends
  float lowest = kNoHeight, highest = kNoHeight;
  Eigen::Vector2d offsets_m = Eigen::Vector2d::Zero();  // weighted sum of the positions relative to the cell's centre
  Eigen::Vector3f rays = Eigen::Vector3f::Zero();       // sum of the directions from the cameras
  float ranges_m = 0, longest_baseline_m = 0;           // sum of the ranges
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
};

Grid make_grid(const MapOptions& options, const Eigen::Vector3d& middle) {
  Grid grid;
  const double half = 0.5 * options.extent_m, cell = options.cell_m;
  grid.place = {std::floor((middle.x() - half) / cell) * cell, std::ceil((middle.y() + half) / cell) * cell, cell};
  grid.width = grid.height = static_cast<int>(std::ceil(options.extent_m / cell));
  grid.cells.resize(static_cast<std::size_t>(grid.width) * static_cast<std::size_t>(grid.height));
  return grid;
}

// A point in its cell.
struct CellPoint {
  float height_m, weight;
};

// The points of all cells, sorted by cell: those of cell k are [first[k], first[k + 1]).
struct CellPoints {
  std::vector<std::size_t> first;
  std::vector<CellPoint> points;
};

CellPoints rasterize_points(std::span<const SurfacePoint> points, const Pose& map_from_body, Grid& grid) {
  const Eigen::Matrix3f rotation = map_from_body.rotation_matrix().cast<float>();
  const Eigen::Vector3f translation = map_from_body.translation().cast<float>();
  const auto information_of = [&](const SurfacePoint& point) {  // of its height
    const double sigma =
        std::max(std::abs(static_cast<double>(rotation.row(2).dot(point.ray)) * point.sigma_m), kLeastSigma_m);
    return 1 / (sigma * sigma);
  };
  constexpr std::uint32_t kOutside = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> cells(points.size(), kOutside);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const SurfacePoint& point = points[i];
    const Eigen::Vector3f p = rotation * point.in_body + translation;
    const GridCell at = cell_at(grid.place, p.x(), p.y());
    if (at.column < 0 || at.row < 0 || at.column >= grid.width || at.row >= grid.height) continue;
    cells[i] = static_cast<std::uint32_t>(at.row) * static_cast<std::uint32_t>(grid.width) +
               static_cast<std::uint32_t>(at.column);
    Cell& cell = grid.cells[cells[i]];
    ++cell.count;
    const double information = information_of(point);
    cell.weights += information;
    cell.offsets_m += information * (p.head<2>().cast<double>() - cell_centre(grid.place, at.column, at.row));
    cell.rays += rotation * point.ray;
    cell.ranges_m += point.range_m;
    cell.longest_baseline_m = std::max(cell.longest_baseline_m, point.baseline_m);
    cell.truncated = cell.truncated || point.truncated;
    cell.ground += point.kind == GroundClass::ground ? 1 : 0;
  }
  CellPoints sorted;
  sorted.first.assign(grid.cells.size() + 1, 0);
  for (std::size_t k = 0; k < grid.cells.size(); ++k)
    sorted.first[k + 1] = sorted.first[k] + static_cast<std::size_t>(grid.cells[k].count);
  sorted.points.resize(sorted.first.back());
  std::vector<std::size_t> next(sorted.first.begin(), sorted.first.end() - 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (cells[i] == kOutside) continue;
    const float height_m = (rotation * points[i].in_body + translation).z();
    sorted.points[next[cells[i]]++] = {height_m, static_cast<float>(information_of(points[i]))};
  }
  return sorted;
}

// Heights of each cell between the trimmed ends.
void sum_heights(CellPoints& sorted, double trimmed_fraction, Grid& grid, const ThreadPool& workers) {
  workers.parallel_for(0, grid.height, 8, [&](int from, int to) {
    const std::size_t width = static_cast<std::size_t>(grid.width);
    for (std::size_t k = static_cast<std::size_t>(from) * width; k < static_cast<std::size_t>(to) * width; ++k) {
      auto begin = sorted.points.begin() + static_cast<std::ptrdiff_t>(sorted.first[k]),
           end = sorted.points.begin() + static_cast<std::ptrdiff_t>(sorted.first[k + 1]);
      if (begin == end) continue;
      const auto trimmed = static_cast<std::ptrdiff_t>(trimmed_fraction * static_cast<double>(end - begin));
      if (trimmed > 0) {
        const auto lower = [](const CellPoint& a, const CellPoint& b) { return a.height_m < b.height_m; };
        std::nth_element(begin, begin + trimmed, end, lower);
        begin += trimmed;
        std::nth_element(begin, end - trimmed, end, lower);
        end -= trimmed;
      }
      Cell& cell = grid.cells[k];
      cell.lowest = cell.highest = begin->height_m;
      for (auto point = begin; point != end; ++point) {
        const auto weight = static_cast<double>(point->weight);
        cell.used_weights += weight;
        cell.sum += weight * static_cast<double>(point->height_m);
        cell.lowest = std::min(cell.lowest, point->height_m);
        cell.highest = std::max(cell.highest, point->height_m);
      }
    }
  });
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

// Cells that v-disparity calls ground; all known ones where there are none.
Image<std::uint8_t> ground_cells(const Grid& grid, const LocalMap& map) {
  const auto [w, h] = map.size();
  Image<std::uint8_t> is_ground(w, h);
  bool any = false;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const Cell& cell = grid.at(x, y);
      is_ground(x, y) = map.count(x, y) > 0 && 2 * cell.ground > cell.count ? 1 : 0;
      any = any || is_ground(x, y) != 0;
    }
  }
  for (int y = 0; !any && y < h; ++y) {
    for (int x = 0; x < w; ++x) is_ground(x, y) = map.count(x, y) > 0 ? 1 : 0;
  }
  return is_ground;
}

// Makes cells unknown; returns whether any was known.
bool leave_out(const Image<std::uint8_t>& cells, LocalMap& map) {
  bool any = false;
  for (int y = 0; y < cells.height(); ++y) {
    for (int x = 0; x < cells.width(); ++x) {
      if (cells(x, y) == 0 || !(map.count(x, y) > 0)) continue;
      any = true;
      for (Image<float>* layer : {&map.elevation_m, &map.elevation_min_m, &map.elevation_max_m, &map.variance_m2})
        (*layer)(x, y) = kNoHeight;
      map.count(x, y) = 0;
    }
  }
  return any;
}

// Slope of a surface, by the differences between the neighbours of a cell that are known.
Eigen::Vector2d slope_at(const Image<float>& surface_m, int x, int y, double cell_m) {
  const auto along = [&](int dx, int dy) {
    const auto height = [&](int sign) {
      const int c = x + sign * dx, r = y - sign * dy;  // rows run south
      return surface_m.contains(c, r) ? static_cast<double>(surface_m(c, r)) : static_cast<double>(kNoHeight);
    };
    const double slope = (height(1) - height(-1)) / (2 * cell_m);
    return std::isfinite(slope) ? slope : 0;
  };
  return {along(1, 0), along(0, 1)};
}

// Adds the errors of the calibration to the variances.
void add_calibration_errors(const CalibrationErrors& errors, const Grid& grid, LocalMap& map) {
  const auto [w, h] = map.size();
  map.common_variance_m2 = Image<float>(w, h, kNoHeight);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const Cell& cell = grid.at(x, y);
      if (!(map.count(x, y) > 0)) continue;
      map.common_variance_m2(x, y) = 0;
      if (cell.ranges_m == 0) continue;
      const Eigen::Vector3d arm =
          (cell.ranges_m / static_cast<float>(cell.count) * cell.rays.normalized()).cast<double>();
      const internal::CellSight sight{arm, static_cast<double>(cell.longest_baseline_m),
                                      slope_at(map.ground_m, x, y, map.place.cell_m)};
      map.common_variance_m2(x, y) = static_cast<float>(internal::calibration_variance_m2(sight, errors));
      map.variance_m2(x, y) += map.common_variance_m2(x, y);
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

Image<float> at_cell_centres(ImageView<const float> means_m, ImageView<const CellOffset> offsets) {
  const auto [w, h] = means_m.size();
  const auto at = [&](int x, int y) { return means_m.contains(x, y) ? means_m(x, y) : kNoHeight; };
  // The smaller one of the differences to both neighbours; 0 where one is unknown or their signs differ.
  const auto minmod = [](float before, float here, float after) {
    const float a = here - before, b = after - here;
    if (!(a * b > 0)) return 0.0F;
    return std::abs(a) < std::abs(b) ? a : b;
  };
  Image<float> elevations(w, h);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const float z = means_m(x, y);
      if (!std::isfinite(z)) {
        elevations(x, y) = kNoHeight;
        continue;
      }
      const CellOffset& offset = offsets(x, y);
      elevations(x, y) = z - offset.east * minmod(at(x - 1, y), z, at(x + 1, y)) -
                         offset.north * minmod(at(x, y + 1), z, at(x, y - 1));  // rows run south
    }
  }
  return elevations;
}

std::vector<SurfacePoint> surface_points(const MergedRange& merged) {
  std::size_t known = 0;
  for (int y = 0; y < merged.range_m.height(); ++y) {
    const float* const row = merged.range_m.row(y);
    known += static_cast<std::size_t>(
        std::count_if(row, row + merged.range_m.width(), [](float range) { return std::isfinite(range); }));
  }
  std::vector<SurfacePoint> points;
  points.reserve(known);
  const Eigen::Matrix3d rotation = merged.body_from_centre.rotation_matrix();
  for (int y = 0; y < merged.range_m.height(); ++y) {
    for (int x = 0; x < merged.range_m.width(); ++x) {
      const float range = merged.range_m(x, y);
      if (!std::isfinite(range)) continue;
      const Eigen::Vector3d ray = rotation * merged.camera.direction(x, y);
      const Eigen::Vector3d place = merged.body_from_centre.translation() + static_cast<double>(range) * ray;
      points.push_back({place.cast<float>(), merged.sigma_m(x, y), ray.cast<float>(),
                        static_cast<GroundClass>(merged.classes(x, y)),
                        !merged.truncated.empty() && merged.truncated(x, y) != 0, range,
                        merged.baseline_m.empty() ? 0.0F : merged.baseline_m(x, y)});
    }
  }
  return points;
}

Result<MapGenerator> MapGenerator::create(const MapOptions& options, ThreadPool workers) {
  if (Status valid = validate(options, "map options"); !valid) return failure(valid);
  return MapGenerator(options, std::move(workers));
}

namespace {

// A map of the elevations of the grid's cells, without ground and classes.
LocalMap map_of(const Grid& grid, const Pose& map_from_body, int min_points) {
  LocalMap map;
  map.map_from_body = map_from_body;
  map.place = grid.place;
  const int w = grid.width, h = grid.height;
  for (Image<float>* layer :
       {&map.elevation_m, &map.elevation_min_m, &map.elevation_max_m, &map.variance_m2, &map.ground_m})
    *layer = Image<float>(w, h, kNoHeight);
  for (Image<float>* layer : {&map.count, &map.occupancy_logodds}) *layer = Image<float>(w, h, 0.0F);
  map.kind = Image<GroundClass>(w, h);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const Cell& cell = grid.at(x, y);
      if (cell.count == 0 || cell.count < min_points) continue;
      map.elevation_m(x, y) = static_cast<float>(cell.sum / cell.used_weights);
      map.elevation_min_m(x, y) = cell.lowest;
      map.elevation_max_m(x, y) = cell.highest;
      map.count(x, y) = static_cast<float>(cell.count);
      // Errors of a cell's points are correlated (disparities are smooth), so the variance of their mean is that of
      // one.
      map.variance_m2(x, y) = static_cast<float>(cell.count / cell.weights);
    }
  }
  return map;
}

Image<internal::LineOfSight> lines_of_sight(const Grid& grid) {
  Image<internal::LineOfSight> towards_camera(grid.width, grid.height);
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width; ++x) {
      const Cell& cell = grid.at(x, y);
      const Eigen::Vector3f& rays = cell.rays;
      const float along = std::max(rays.head<2>().norm(), 1e-6F);
      internal::LineOfSight& line = towards_camera(x, y);
      line = {-rays.x() / along, -rays.y() / along, -rays.z() / along};
      if (cell.ranges_m > 0) line.length_m = cell.ranges_m / static_cast<float>(cell.count) * along / rays.norm();
    }
  }
  return towards_camera;
}

// The elevations of the cells at the mean positions of their points, moved to the centres.
void move_to_centres(const Grid& grid, LocalMap& map) {
  const auto [w, h] = map.size();
  Image<CellOffset> offsets(w, h);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const Cell& cell = grid.at(x, y);
      if (cell.count == 0) continue;
      const Eigen::Vector2f offset = (cell.offsets_m / (cell.weights * map.place.cell_m)).cast<float>();
      offsets(x, y) = {offset.x(), offset.y()};
    }
  }
  map.elevation_m = at_cell_centres(map.elevation_m, offsets);
}

// Leaves out the cells that wrong matches have made, and fits the ground to the rest.
void fit_ground_of_possible_cells(const MapOptions& options, const Grid& grid, const ThreadPool& workers,
                                  LocalMap& map) {
  const internal::CellHeights heights{map.elevation_min_m, map.elevation_max_m};
  const double margin_m = kSupportGap * options.cell_m;
  leave_out(internal::isolated_cells(heights, margin_m, options.min_support_cells), map);
  const auto fit = [&] {
    return fit_ground(map.elevation_m, ground_cells(grid, map), options.cell_m, options.ground, workers);
  };
  map.ground_m = fit();
  const Image<internal::LineOfSight> towards_camera = lines_of_sight(grid);
  const internal::GroundView view{map.ground_m, towards_camera, options.cell_m, margin_m,
                                  kOpening * options.ground.window_m};
  if (leave_out(internal::cells_seen_through_ground(heights, view), map)) map.ground_m = fit();
}

}  // namespace

LocalMap MapGenerator::generate(std::span<const SurfacePoint> points, const Pose& map_from_body) const {
  Grid grid = make_grid(options_, map_from_body.translation());
  CellPoints sorted = rasterize_points(points, map_from_body, grid);
  sum_heights(sorted, options_.trimmed_fraction, grid, workers_);
  LocalMap map = map_of(grid, map_from_body, options_.min_points);
  move_to_centres(grid, map);
  fit_ground_of_possible_cells(options_, grid, workers_, map);
  classify(options_, grid, map);
  add_calibration_errors(options_.calibration, grid, map);
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
