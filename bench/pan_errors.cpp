// What errors of the pan and tilt angles do to the map of a stop. `make bench-pan_errors`.
//
//   pan_errors [--from FOLDER] [--stops N] [--draws N] [--error-deg X] SCENARIO...
//
// Uses recordings from scripts/recordings without errors of the rover. Every view of a stop gets errors of pan and
// tilt, normally distributed and independent; the variance of the map states them and no other error of the
// calibration. NEES: squared error of the elevation of a cell over its variance, 1 on average where the variance is
// right; cells within 0.3 m of an obstacle or a cavity are left out, where the mean elevation of a cell is not that of
// its points.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "mars_scores.h"
#include "mars_stops.h"
#include "spartan/numerics/random.h"
#include "standard_recordings.h"

namespace spartan {
namespace {

constexpr double kAroundHazards_m = 0.3;
constexpr double kFar_m = 2.5;

// Of a grid whose first row is the northernmost.
Eigen::Vector2d centre_of(const GeoTransform& place, int column, int row) {
  return {place.west_m + (column + 0.5) * place.cell_m, place.north_m - (row + 0.5) * place.cell_m};
}

struct MapScores {
  Sums sums;
  std::vector<double> nees, far_nees;

  static double quantile(std::vector<double> values, double part) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[static_cast<std::size_t>(part * static_cast<double>(values.size() - 1))];
  }
  static double mean(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value;
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
  }
  static double inside(const std::vector<double>& values, double sigmas) {
    const auto count =
        std::count_if(values.begin(), values.end(), [&](double value) { return value <= sigmas * sigmas; });
    return values.empty() ? 0 : 100.0 * static_cast<double>(count) / static_cast<double>(values.size());
  }
  void print(const std::string& name) const {
    fmt::print("{:<46} {:>8} {:>7.2f} {:>7.2f} {:>7.2f} {:>7.1f} {:>7.1f} {:>7.1f} {:>5}/{:<5} {:>7.2f}\n", name,
               nees.size(), mean(nees), mean(far_nees), quantile(nees, 0.5), inside(nees, 2), inside(nees, 3),
               1e3 * std::sqrt(sums.squares / sums.cells), sums.found, sums.obstacles,
               100 * sums.false_marks / sums.free);
  }
};

// Mean true elevation of each cell of a map, and whether a hazard is near.
struct TrueCells {
  Image<float> mean_m;
  Image<std::uint8_t> near_hazard;
};

TrueCells true_cells(const Drive& drive, const LocalMap& map) {
  const auto [width, height] = map.size();
  TrueCells cells{Image<float>(width, height, 0), Image<std::uint8_t>(width, height, 0)};
  Image<float> count(width, height, 0);
  const Image<float>&elevation = drive.elevation.bands[0], &above = drive.obstacles.bands[1];
  const int around = static_cast<int>(std::lround(kAroundHazards_m / map.place.cell_m));
  for (int y = 0; y < elevation.height(); ++y) {
    for (int x = 0; x < elevation.width(); ++x) {
      const Eigen::Vector2d place = centre_of(drive.elevation.place, x, y);
      const GridCell cell = cell_at(map.place, place.x(), place.y());
      if (cell.column < -around || cell.row < -around || cell.column >= width + around || cell.row >= height + around)
        continue;
      if (count.contains(cell.column, cell.row)) {
        cells.mean_m(cell.column, cell.row) += elevation(x, y);
        ++count(cell.column, cell.row);
      }
      if (std::abs(above(x, y)) < 0.03F) continue;
      for (int v = std::max(0, cell.row - around); v <= std::min(height - 1, cell.row + around); ++v) {
        for (int u = std::max(0, cell.column - around); u <= std::min(width - 1, cell.column + around); ++u)
          cells.near_hazard(u, v) = 1;
      }
    }
  }
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) cells.mean_m(x, y) /= count(x, y);
  }
  return cells;
}

void score(const Drive& drive, StopMapper& mapper, const Pose& pose, MapScores& scores) {
  const LocalMap map = mapper.map(surface_points(mapper.merge()), pose);
  const TrueCells cells = true_cells(drive, map);
  for (int y = 0; y < map.size().height; ++y) {
    for (int x = 0; x < map.size().width; ++x) {
      const double error = map.elevation_m(x, y) - cells.mean_m(x, y);
      if (!std::isfinite(error) || cells.near_hazard(x, y) != 0) continue;
      const double nees = error * error / map.variance_m2(x, y);
      scores.nees.push_back(nees);
      if ((centre_of(map.place, x, y) - pose.translation().head<2>()).norm() > kFar_m) scores.far_nees.push_back(nees);
    }
  }
  Visibility visibility(map.size());
  for (const StopView& view : mapper.views())
    add_true_view(drive, view.pair, view.stamp, view.geometry, pose, map.place, visibility);
  MapMetricsOptions scoring;
  scoring.viewpoint_m = pose.translation().head<2>();
  scoring.farthest_m = 4;
  scores.sums.add(
      internal::evaluate_map({map.place, map.elevation_m, class_band(map.kind), visibility.pixels, visibility.lowest_m},
                             DriveTruth(drive).view(), scoring));
}

// Adds the views of a stop with errors of their angles.
void add_views_with_errors(Drive& drive, Imager& imager, StopMapper& mapper, const std::vector<FrameKey>& frames,
                           double error_rad, Random& random) {
  mapper.leave();
  for (const auto& [pair, stamp] : frames) {
    auto frame = drive.source->frame_at(pair, stamp);
    if (!frame) continue;
    frame->pan_rad += random.normal(0, error_rad);
    frame->tilt_rad += random.normal(0, error_rad);
    const auto rectified = imager.process(*frame);
    if (rectified) (void)mapper.add(*rectified, drive.rig.find_pair(pair)->nearest_m);
  }
}

void evaluate(const std::string& folder, const std::string& scenario, int stops, int draws, double error_deg) {
  auto drive = open_drive(folder + "/" + scenario);
  if (!drive) {
    fmt::print("{:<18} skipped: {} (create it with scripts/recordings)\n", scenario, drive.error().message());
    return;
  }
  auto imager = Imager::create(drive->rig, ImagingOptions(), ThreadPool(2));
  if (!imager) return;
  const auto measure = [&](const std::string& name, double error, double stated, int times) {
    MappingOptions options;
    auto& calibration = options.map.calibration;
    calibration.pair_rotation_deg = calibration.scale_percent = calibration.mount_rotation_deg = 0;
    calibration.mount_mm = 0;
    calibration.pan_tilt_deg = stated;
    StopMapper mapper = StopMapper::create({}, options, ThreadPool(2)).value();
    MapScores scores;
    Random random(7);
    int done = 0;
    for (const auto& [position, frames] : drive->stops) {
      if (done++ == stops) break;
      for (int i = 0; i < times; ++i) {
        add_views_with_errors(*drive, *imager, mapper, frames, error * kRadiansPerDegree, random);
        score(*drive, mapper, true_pose(*drive, frames.front().left_stamp), scores);
      }
    }
    scores.print(scenario + ", " + name);
    std::fflush(stdout);
  };
  measure("no error, none stated", 0, 0, 1);
  measure(fmt::format("error {} deg, none stated", error_deg), error_deg, 0, draws);
  measure(fmt::format("error {} deg, {} deg stated", error_deg, error_deg), error_deg, error_deg, draws);
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--stops", "10"}, {"--draws", "3"}, {"--error-deg", "0.1"}});
  std::vector<std::string>& scenarios = arguments.scenarios;
  if (scenarios.empty()) scenarios = {"rocky_20pct", "crater_rim"};
  fmt::print("{:<46} {:>8} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>11} {:>7}\n", "", "cells", "NEES", "> 2.5 m",
             "median", "in 2 σ%", "in 3 σ%", "RMS mm", "obstacles", "false %");
  for (const std::string& scenario : scenarios) {
    evaluate(arguments.folder, scenario, arguments.number("--stops"), arguments.number("--draws"),
             std::stod(arguments.options.at("--error-deg")));
  }
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
