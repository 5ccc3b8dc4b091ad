// Maps of simulated stops against ground truth. `make bench-mars_map`.
//
//   mars_map [--from FOLDER] [--stops N] [--list 1] SCENARIO...
//
// Uses recordings from scripts/recordings; --list prints the obstacles and cavities that were missed. Default: 10 stops
// each of rocky_20pct, crater_rim, flat_featureless, diffuse_200lux. Poses are the true ones, so that only the maps are
// evaluated.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "mars_scores.h"
#include "mars_stops.h"
#include "spartan/core/image.h"
#include "spartan/core/stage_clock.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/eval/internal/map_metrics.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "standard_recordings.h"

namespace spartan {

using namespace internal;
namespace {

// Detected obstacles by height, and the confusion matrix of visible cells, over all scenarios.
struct Totals {
  static constexpr std::array<double, 5> kHeights_m{0.1, 0.15, 0.2, 0.3, 9};
  std::array<int, 4> things{}, found{};
  std::array<std::array<std::int64_t, 4>, 4> confusion{};

  void add(const MapMetrics& m) {
    for (const HazardScore& thing : m.obstacles) {
      for (std::size_t i = 0; i < things.size(); ++i) {
        if (thing.height_m < kHeights_m[i] || thing.height_m >= kHeights_m[i + 1]) continue;
        ++things[i];
        found[i] += thing.found ? 1 : 0;
      }
    }
    for (std::size_t i = 0; i < 4; ++i) {
      for (std::size_t j = 0; j < 4; ++j) confusion[i][j] += m.confusion[i][j];
    }
  }
  void print() const {
    fmt::print("\nobstacles detected by height:");
    for (std::size_t i = 0; i < things.size(); ++i) {
      const std::string heights = i + 1 < things.size()
                                      ? fmt::format("{:.2f}-{:.2f} m", kHeights_m[i], kHeights_m[i + 1])
                                      : fmt::format("over {:.2f} m", kHeights_m[i]);
      fmt::print("  {} {}/{}", heights, found[i], things[i]);
    }
    constexpr std::array<const char*, 4> kNames{"unknown", "free", "obstacle", "cavity"};
    fmt::print("\n{:<22}", "cells: true, mapped as");
    for (const char* name : kNames) fmt::print("{:>10}", name);
    for (std::size_t i = 1; i < 4; ++i) {
      fmt::print("\n{:<22}", kNames[i]);
      for (const std::int64_t count : confusion[i]) fmt::print("{:>10}", count);
    }
    fmt::print("\n");
  }
};

constexpr std::array<double, 5> kBorders_m{0, 1.5, 2.5, 4, 4};

void list_missed(std::int64_t position, const char* what, const std::vector<HazardScore>& things) {
  for (const HazardScore& thing : things) {
    if (thing.found || thing.height_m < 0.15) continue;
    fmt::print(
        "  {} missed at position {}: ({:.2f}, {:.2f}), {:.2f} m, diameter {:.2f} m, {} of {} visible cells marked\n",
        what, position, thing.middle_m.x(), thing.middle_m.y(), thing.height_m, thing.diameter_m, thing.marked_cells,
        thing.visible_cells);
  }
}

void evaluate(const std::string& folder, const std::string& scenario, int wanted, bool list, Totals& totals) {
  auto drive = open_drive(folder + "/" + scenario);
  if (!drive) {
    fmt::print("{:<18} skipped: {} (create it with scripts/recordings)\n", scenario, drive.error().message());
    return;
  }
  auto imager = Imager::create(drive->rig, ImagingOptions(), ThreadPool(2));
  if (!imager) return;
  StopMapper mapper = StopMapper::create({}, {}, ThreadPool(2)).value();
  std::array<Sums, 4> sums;  // three bins of range, all
  int stops = 0;
  const DriveTruth of_drive(*drive);
  const TerrainTruth truth = of_drive.view();
  for (const auto& [position, frames] : drive->stops) {
    if (stops == wanted) break;
    ++stops;
    add_views(*drive, *imager, mapper, frames);
    const MergedRange merged = mapper.merge();
    const Pose pose = true_pose(*drive, frames.front().left_stamp);
    const LocalMap map = mapper.map(surface_points(merged), pose);
    Visibility visibility(map.size());
    for (const StopView& view : mapper.views())
      add_true_view(*drive, view.pair, view.stamp, view.geometry, pose, map.place, visibility);
    for (std::size_t bin = 0; bin < sums.size(); ++bin) {
      MapMetricsOptions scoring;
      scoring.viewpoint_m = pose.translation().head<2>();
      scoring.nearest_m = bin < 3 ? kBorders_m[bin] : 0;
      scoring.farthest_m = kBorders_m[bin + 1];
      const MapMetrics metrics = evaluate_map(
          {map.place, map.elevation_m, class_band(map.kind), visibility.pixels, visibility.lowest_m}, truth, scoring);
      sums[bin].add(metrics);
      if (bin == 3) totals.add(metrics);
      if (list && bin == 3) {
        list_missed(position, "obstacle", metrics.obstacles);
        list_missed(position, "cavity", metrics.cavities);
      }
    }
  }
  for (std::size_t bin = 0; bin < sums.size(); ++bin) {
    const Sums& s = sums[bin];
    const std::string range = bin < 3 ? fmt::format("{:.1f}-{:.1f} m", kBorders_m[bin], kBorders_m[bin + 1]) : "all";
    print_row(scenario, range, s);
  }
  const StopMapperTimes& times = mapper.times();
  fmt::print("{:<18} seconds a stop on two threads: disparity {:.2f}, v-disparity {:.2f}, merging {:.2f}, map {:.2f}\n",
             "", 1e-3 * times.disparity / stops, 1e-3 * times.v_disparity / stops, 1e-3 * times.merging / stops,
             1e-3 * times.map / stops);
  std::fflush(stdout);
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--stops", "10"}, {"--list", "0"}});
  std::vector<std::string>& scenarios = arguments.scenarios;
  if (scenarios.empty()) scenarios = {"rocky_20pct", "crater_rim", "flat_featureless", "diffuse_200lux"};
  print_header("range");
  Totals totals;
  for (const std::string& scenario : scenarios) {
    evaluate(arguments.folder, scenario, arguments.number("--stops"), arguments.number("--list") != 0, totals);
  }
  totals.print();
  fmt::print("peak memory {:.0f} MB\n", 1e-6 * static_cast<double>(peak_memory_bytes()));
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
