// Scores of terrain maps of simulated recordings.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "mars_stops.h"
#include "spartan/core/image.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/eval/internal/map_metrics.h"

namespace spartan {

using internal::HazardScore;
using internal::MapMetrics;
using internal::MapMetricsOptions;
using internal::TerrainTruth;

// The ground truth of a drive, with the level without rocks. Borrows the drive.
class DriveTruth {
 public:
  explicit DriveTruth(const Drive& drive) : drive_(drive), level_(drive.elevation.bands[0].size()) {
    for (int y = 0; y < level_.height(); ++y) {
      // height_m of obstacles.tif is the surface above the level.
      for (int x = 0; x < level_.width(); ++x)
        level_(x, y) = drive.elevation.bands[0](x, y) - drive.obstacles.bands[1](x, y);
    }
  }
  TerrainTruth view() const {
    return {drive_.elevation.place, drive_.elevation.bands[0], drive_.elevation.bands[1], level_};
  }

 private:
  const Drive& drive_;
  Image<float> level_;
};

// What the cameras can see of the cells of a map.
struct Visibility {
  explicit Visibility(ImageSize size)
      : pixels(size), lowest_m(size.width, size.height, std::numeric_limits<float>::quiet_NaN()) {}
  Image<std::uint16_t> pixels;  // visible in both cameras of a pair, maximum over the pairs
  Image<float> lowest_m;        // of the visible true surface
};

// Adds the true disparities of one frame, up to a horizontal distance from the body.
inline void add_true_view(const Drive& drive, const std::string& pair, Stamp stamp, const ViewGeometry& view,
                          const Pose& world_from_body, const GeoTransform& place, Visibility& visibility,
                          double farthest_m = std::numeric_limits<double>::infinity()) {
  const std::string name = fmt::format("/{}/{}.png", pair, stamp.ns);
  const auto disparity = read_disparity(drive.folder + "/truth/disparity" + name);
  const auto mask = read_truth_mask(drive.folder + "/truth/mask" + name);
  if (!disparity || !mask) return;
  Image<std::uint16_t> counts(visibility.pixels.size());
  for (int y = 0; y < disparity->height(); ++y) {
    for (int x = 0; x < disparity->width(); ++x) {
      if ((*mask)(x, y) != 255) continue;
      const Eigen::Vector3d p =
          world_from_body * view.body_from_left * view.stereo.triangulate(x, y, (*disparity)(x, y));
      if ((p - world_from_body.translation()).head<2>().norm() > farthest_m) continue;
      const GridCell cell = cell_at(place, p.x(), p.y());
      if (!counts.contains(cell.column, cell.row)) continue;
      if (counts(cell.column, cell.row) != 0xFFFF) ++counts(cell.column, cell.row);
      float& lowest = visibility.lowest_m(cell.column, cell.row);
      lowest = std::fmin(lowest, static_cast<float>(p.z()));
    }
  }
  for (int y = 0; y < counts.height(); ++y) {
    for (int x = 0; x < counts.width(); ++x) visibility.pixels(x, y) = std::max(visibility.pixels(x, y), counts(x, y));
  }
}

struct Sums {
  double cells = 0, error = 0, squares = 0, visible = 0, covered = 0, free = 0, false_marks = 0;
  int obstacles = 0, found = 0, cavities = 0, cavities_found = 0;
  void add(const MapMetrics& m) {
    cells += m.elevation_cells;
    error += m.elevation_cells * m.bias_m;
    squares += m.elevation_cells * m.rms_m * m.rms_m;
    visible += m.visible_cells;
    covered += m.covered_cells;
    free += m.free_cells;
    false_marks += m.false_cells;
    for (const HazardScore& thing : m.obstacles) {
      if (thing.height_m < 0.15) continue;
      ++obstacles;
      found += thing.found ? 1 : 0;
    }
    for (const HazardScore& thing : m.cavities) {
      ++cavities;
      cavities_found += thing.found ? 1 : 0;
    }
  }
};

inline void print_header(const char* second) {
  fmt::print("{:<18} {:<10} {:>7} {:>7} {:>9} {:>12} {:>9} {:>12}\n", "scenario", second, "bias mm", "RMS mm",
             "covered %", "obstacles", "false %", "cavities");
}

inline void print_row(const std::string& scenario, const std::string& second, const Sums& s) {
  fmt::print("{:<18} {:<10} {:>7.1f} {:>7.1f} {:>9.1f} {:>6}/{:<5} {:>9.3f} {:>6}/{:<5}\n", scenario, second,
             1000 * s.error / s.cells, 1000 * std::sqrt(s.squares / s.cells), 100 * s.covered / s.visible, s.found,
             s.obstacles, 100 * s.false_marks / s.free, s.cavities_found, s.cavities);
}

}  // namespace spartan
