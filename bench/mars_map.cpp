// Maps of simulated stops beside the truth. `make bench-mars_map`.
//
//   mars_map [--from FOLDER] [--stops N] SCENARIO...      recordings as scripts/recordings makes them
//
// Default: 10 stops each of rocky_20pct, crater_rim, flat_featureless, diffuse_200lux. Poses are the true ones: only
// the map is judged.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/frame_source.h"
#include "spartan/core/files.h"
#include "spartan/core/geotiff.h"
#include "spartan/core/trajectory.h"
#include "spartan/eval/disparity_truth.h"
#include "spartan/eval/map_metrics.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/disparity_merger.h"
#include "spartan/reconstruction/disparity_options.h"
#include "spartan/reconstruction/map_generator.h"
#include "spartan/reconstruction/v_disparity.h"
#include "standard_recordings.h"

namespace spartan {
namespace {

using Clock = std::chrono::steady_clock;

struct Times {
  double disparity = 0, v_disparity = 0, merging = 0, map = 0;
};

// Adds the time since `start` and starts again.
void lap(Clock::time_point& start, double& sum) {
  const auto now = Clock::now();
  sum += std::chrono::duration<double>(now - start).count();
  start = now;
}

// A recording with its truth.
struct Drive {
  std::string folder;
  std::unique_ptr<FrameSource> source;
  Rig rig;
  Trajectory poses;
  LoadedMap elevation, obstacles;
  std::map<std::int64_t, std::vector<std::pair<std::string, Stamp>>> stops;  // position → pair, stamp of each shot
};

std::optional<Drive> open_drive(const std::string& folder) {
  Drive drive;
  drive.folder = folder;
  auto source = open_recording(folder);
  const auto poses = read_file(folder + "/truth/poses.tum");
  auto elevation = read_geotiff(folder + "/truth/elevation.tif"),
       obstacles = read_geotiff(folder + "/truth/obstacles.tif");
  if (!source || !poses || !elevation || !obstacles) return std::nullopt;
  auto trajectory = parse_tum(*poses, "truth");
  if (!trajectory) return std::nullopt;
  drive.source = std::move(*source);
  drive.rig = drive.source->info().rig;
  drive.poses = std::move(*trajectory);
  drive.elevation = std::move(*elevation);
  drive.obstacles = std::move(*obstacles);
  std::map<std::int64_t, bool> panned;
  for (const bool for_odometry : {false, true}) {
    for (const StereoPair& pair : drive.rig.pairs) {
      if (pair.for_odometry != for_odometry) continue;
      for (const Stamp stamp : drive.source->announced_stamps(pair.name)) {
        const auto frame = drive.source->frame_at(pair.name, stamp);
        if (!frame || (for_odometry && !panned.contains(frame->position_id))) continue;
        panned[frame->position_id] = true;
        drive.stops[frame->position_id].emplace_back(pair.name, stamp);
      }
    }
  }
  return drive;
}

Pose true_pose(const Drive& drive, Stamp stamp) {
  return std::min_element(drive.poses.begin(), drive.poses.end(),
                          [&](const StampedPose& a, const StampedPose& b) {
                            return std::abs(a.stamp.ns - stamp.ns) < std::abs(b.stamp.ns - stamp.ns);
                          })
      ->pose;
}

// Counts, per cell of the map, the pixels of one shot that both eyes see; keeps the larger of this and what was there.
void count_visible(const Drive& drive, const std::string& pair, Stamp stamp, const ViewGeometry& view,
                   const Pose& world_from_body, const MapPlace& place, Image<std::uint16_t>& visible) {
  const std::string name = fmt::format("/{}/{}.png", pair, stamp.ns);
  const auto disparity = read_disparity(drive.folder + "/truth/disparity" + name);
  const auto mask = read_truth_mask(drive.folder + "/truth/mask" + name);
  if (!disparity || !mask) return;
  Image<std::uint16_t> counts(visible.size());
  for (int y = 0; y < disparity->height(); ++y) {
    for (int x = 0; x < disparity->width(); ++x) {
      if ((*mask)(x, y) != 255) continue;
      const Eigen::Vector3d p =
          world_from_body * view.body_from_left * view.stereo.triangulate(x, y, (*disparity)(x, y));
      const GridCell cell = cell_at(place, p.x(), p.y());
      if (counts.contains(cell.column, cell.row) && counts(cell.column, cell.row) != 0xFFFF)
        ++counts(cell.column, cell.row);
    }
  }
  for (int y = 0; y < counts.height(); ++y) {
    for (int x = 0; x < counts.width(); ++x) visible(x, y) = std::max(visible(x, y), counts(x, y));
  }
}

// The views of one stop with everything that they borrow.
struct Stop {
  std::vector<Image<float>> disparities;
  std::vector<Image<std::uint8_t>> lefts, classes;
  std::vector<ViewGeometry> geometries;
  std::vector<MergedView> views() const {
    std::vector<MergedView> views;
    for (std::size_t i = 0; i < geometries.size(); ++i)
      views.push_back({geometries[i], disparities[i], lefts[i], classes[i]});
    return views;
  }
};

Stop look(Drive& drive, Imager& imager, DisparityComputer& computer,
          const std::vector<std::pair<std::string, Stamp>>& shots, Times& times) {
  Stop stop;
  for (const auto& [pair, stamp] : shots) {
    const auto frame = drive.source->frame_at(pair, stamp);
    if (!frame) continue;
    const auto shot = imager.process(*frame);
    if (!shot) continue;
    auto start = Clock::now();
    const auto range = disparity_range(shot->geometry, drive.rig.find_pair(pair)->nearest_m);
    const auto image = computer.compute(shot->left, shot->right, range, shot->left_mask, shot->right_mask);
    if (!image) continue;
    lap(start, times.disparity);
    const GroundPlane expected{shot->body_from_left.rotation().conjugate() * Eigen::Vector3d::UnitZ(),
                               shot->body_from_left.translation().z()};
    auto seen = compute_v_disparity(image->disparity, shot->geometry, expected, {}, Workers(2));
    lap(start, times.v_disparity);
    stop.disparities.push_back(Image<float>::copy_of(image->disparity));
    stop.lefts.push_back(Image<std::uint8_t>::copy_of(shot->left));
    stop.classes.push_back(seen ? std::move(seen->classes) : Image<std::uint8_t>(shot->geometry.size));
    stop.geometries.push_back({shot->geometry, shot->body_from_left});
  }
  return stop;
}

struct Sums {
  double cells = 0, error = 0, squares = 0, visible = 0, covered = 0, free = 0, false_marks = 0;
  int obstacles = 0, found = 0, cavities = 0, cavities_found = 0;
  void add(const MapMetrics& m) {
    cells += m.judged_cells;
    error += m.judged_cells * m.bias_m;
    squares += m.judged_cells * m.rms_m * m.rms_m;
    visible += m.visible_cells;
    covered += m.covered_cells;
    free += m.free_cells;
    false_marks += m.false_cells;
    for (const JudgedThing& thing : m.obstacles) {
      if (thing.height_m < 0.15) continue;
      ++obstacles;
      found += thing.found ? 1 : 0;
    }
    for (const JudgedThing& thing : m.cavities) {
      ++cavities;
      cavities_found += thing.found ? 1 : 0;
    }
  }
};

constexpr std::array<double, 5> kBorders_m{0, 1.5, 2.5, 4, 4};

void judge(const std::string& folder, const std::string& scenario, int wanted) {
  auto drive = open_drive(folder + "/" + scenario);
  if (!drive) {
    fmt::print("{:<18} not there; scripts/recordings makes it\n", scenario);
    return;
  }
  auto imager = Imager::create(drive->rig, ImagingOptions(), Workers(2));
  if (!imager) return;
  DisparityComputer computer(DisparityOptions{}, Workers(2));
  std::array<Sums, 4> sums;  // three bins of range, all
  Times times;
  int stops = 0;
  Image<float> level(drive->elevation.bands[0].size());
  for (int y = 0; y < level.height(); ++y) {
    // height_m of obstacles.tif is the surface over the level.
    for (int x = 0; x < level.width(); ++x)
      level(x, y) = drive->elevation.bands[0](x, y) - drive->obstacles.bands[1](x, y);
  }
  const TrueGround truth{drive->elevation.place, drive->elevation.bands[0], drive->elevation.bands[1], level};
  for (const auto& [position, shots] : drive->stops) {
    if (stops++ == wanted) break;
    const Stop stop = look(*drive, *imager, computer, shots, times);
    auto start = Clock::now();
    const DisparityMerger merger({}, Pose::from_translation({0, 0, 1}), stop.geometries, 0.3, Workers(2));
    const std::vector<MergedView> views = stop.views();
    const MergedRange merged = merger.merge(views);
    lap(start, times.merging);
    const Pose pose = true_pose(*drive, shots.front().second);
    const LocalMap map = MapGenerator({}, Workers(2)).generate(surface_points(merged), pose);
    lap(start, times.map);
    Image<std::uint16_t> visible(map.size());
    for (std::size_t i = 0; i < shots.size(); ++i)
      count_visible(*drive, shots[i].first, shots[i].second, stop.geometries[i], pose, map.place, visible);
    for (std::size_t bin = 0; bin < sums.size(); ++bin) {
      MapScoring scoring;
      scoring.eye_m = pose.translation().head<2>();
      scoring.nearest_m = bin < 3 ? kBorders_m[bin] : 0;
      scoring.farthest_m = kBorders_m[bin + 1];
      sums[bin].add(judge_map({map.place, map.elevation_m, map.kind, visible}, truth, scoring));
    }
  }
  for (std::size_t bin = 0; bin < sums.size(); ++bin) {
    const Sums& s = sums[bin];
    const std::string range = bin < 3 ? fmt::format("{:.1f}-{:.1f} m", kBorders_m[bin], kBorders_m[bin + 1]) : "all";
    fmt::print("{:<18} {:<10} {:>7.1f} {:>7.1f} {:>9.1f} {:>6}/{:<5} {:>9.3f} {:>6}/{:<5}\n", scenario, range,
               1000 * s.error / s.cells, 1000 * std::sqrt(s.squares / s.cells), 100 * s.covered / s.visible, s.found,
               s.obstacles, 100 * s.false_marks / s.free, s.cavities_found, s.cavities);
  }
  fmt::print("{:<18} seconds a stop on two threads: disparity {:.2f}, v-disparity {:.2f}, merging {:.2f}, map {:.2f}\n",
             "", times.disparity / stops, times.v_disparity / stops, times.merging / stops, times.map / stops);
  std::fflush(stdout);
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--stops", "10"}});
  std::vector<std::string>& scenarios = arguments.scenarios;
  if (scenarios.empty()) scenarios = {"rocky_20pct", "crater_rim", "flat_featureless", "diffuse_200lux"};
  fmt::print("{:<18} {:<10} {:>7} {:>7} {:>9} {:>12} {:>9} {:>12}\n", "scenario", "range", "bias mm", "RMS mm",
             "covered %", "obstacles", "false %", "cavities");
  for (const std::string& scenario : scenarios) judge(arguments.folder, scenario, arguments.number("--stops"));
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  try {
    spartan::run({argv + 1, argv + argc});
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "mars_map: %s\n", e.what());
    return 1;
  }
}
