// Maps of simulated stops beside the truth. `make bench-mars_map`.
//
//   mars_map [--from FOLDER] [--stops N] [--list 1] SCENARIO...      recordings as scripts/recordings makes them; with
//                                                                    --list the obstacles that were missed
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
#include <limits>
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
#include "spartan/reconstruction/position_mapper.h"
#include "standard_recordings.h"

namespace spartan {
namespace {

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

// What the eyes could see of the cells of a map.
struct Seen {
  explicit Seen(ImageSize size)
      : pixels(size), lowest_m(size.width, size.height, std::numeric_limits<float>::quiet_NaN()) {}
  Image<std::uint16_t> pixels;  // that both eyes of one pair see, the most of any pair
  Image<float> lowest_m;        // of the true surface
};

// Adds one shot.
void look_truly(const Drive& drive, const std::string& pair, Stamp stamp, const ViewGeometry& view,
                const Pose& world_from_body, const MapPlace& place, Seen& seen) {
  const std::string name = fmt::format("/{}/{}.png", pair, stamp.ns);
  const auto disparity = read_disparity(drive.folder + "/truth/disparity" + name);
  const auto mask = read_truth_mask(drive.folder + "/truth/mask" + name);
  if (!disparity || !mask) return;
  Image<std::uint16_t> counts(seen.pixels.size());
  for (int y = 0; y < disparity->height(); ++y) {
    for (int x = 0; x < disparity->width(); ++x) {
      if ((*mask)(x, y) != 255) continue;
      const Eigen::Vector3d p =
          world_from_body * view.body_from_left * view.stereo.triangulate(x, y, (*disparity)(x, y));
      const GridCell cell = cell_at(place, p.x(), p.y());
      if (!counts.contains(cell.column, cell.row)) continue;
      if (counts(cell.column, cell.row) != 0xFFFF) ++counts(cell.column, cell.row);
      float& lowest = seen.lowest_m(cell.column, cell.row);
      lowest = std::fmin(lowest, static_cast<float>(p.z()));
    }
  }
  for (int y = 0; y < counts.height(); ++y) {
    for (int x = 0; x < counts.width(); ++x) seen.pixels(x, y) = std::max(seen.pixels(x, y), counts(x, y));
  }
}

// The views of one stop, taken by the mapper.
void look(Drive& drive, Imager& imager, PositionMapper& mapper,
          const std::vector<std::pair<std::string, Stamp>>& shots) {
  mapper.leave();
  for (const auto& [pair, stamp] : shots) {
    const auto frame = drive.source->frame_at(pair, stamp);
    if (!frame) continue;
    const auto shot = imager.process(*frame);
    if (shot) (void)mapper.add(*shot, drive.rig.find_pair(pair)->nearest_m);
  }
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

void list_missed(std::int64_t position, const char* what, const std::vector<JudgedThing>& things) {
  for (const JudgedThing& thing : things) {
    if (thing.found || thing.height_m < 0.15) continue;
    fmt::print(
        "  {} missed at position {}: ({:.2f}, {:.2f}), {:.2f} m, diameter {:.2f} m, {} of {} visible cells marked\n",
        what, position, thing.middle_m.x(), thing.middle_m.y(), thing.height_m, thing.diameter_m, thing.marked_cells,
        thing.visible_cells);
  }
}

void judge(const std::string& folder, const std::string& scenario, int wanted, bool list) {
  auto drive = open_drive(folder + "/" + scenario);
  if (!drive) {
    fmt::print("{:<18} not there; scripts/recordings makes it\n", scenario);
    return;
  }
  auto imager = Imager::create(drive->rig, ImagingOptions(), Workers(2));
  if (!imager) return;
  PositionMapper mapper({}, {}, Workers(2));
  std::array<Sums, 4> sums;  // three bins of range, all
  double map_seconds = 0;
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
    look(*drive, *imager, mapper, shots);
    const MergedRange merged = mapper.merge();
    const Pose pose = true_pose(*drive, shots.front().second);
    const auto start = std::chrono::steady_clock::now();
    const LocalMap map = mapper.map(surface_points(merged), pose);
    map_seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    Seen seen(map.size());
    for (const PositionView& view : mapper.views())
      look_truly(*drive, view.pair, view.stamp, view.geometry, pose, map.place, seen);
    for (std::size_t bin = 0; bin < sums.size(); ++bin) {
      MapScoring scoring;
      scoring.eye_m = pose.translation().head<2>();
      scoring.nearest_m = bin < 3 ? kBorders_m[bin] : 0;
      scoring.farthest_m = kBorders_m[bin + 1];
      const MapMetrics metrics =
          judge_map({map.place, map.elevation_m, map.kind, seen.pixels, seen.lowest_m}, truth, scoring);
      sums[bin].add(metrics);
      if (list && bin == 3) {
        list_missed(position, "obstacle", metrics.obstacles);
        list_missed(position, "cavity", metrics.cavities);
      }
    }
  }
  for (std::size_t bin = 0; bin < sums.size(); ++bin) {
    const Sums& s = sums[bin];
    const std::string range = bin < 3 ? fmt::format("{:.1f}-{:.1f} m", kBorders_m[bin], kBorders_m[bin + 1]) : "all";
    fmt::print("{:<18} {:<10} {:>7.1f} {:>7.1f} {:>9.1f} {:>6}/{:<5} {:>9.3f} {:>6}/{:<5}\n", scenario, range,
               1000 * s.error / s.cells, 1000 * std::sqrt(s.squares / s.cells), 100 * s.covered / s.visible, s.found,
               s.obstacles, 100 * s.false_marks / s.free, s.cavities_found, s.cavities);
  }
  const MappingTimes& times = mapper.times();
  fmt::print("{:<18} seconds a stop on two threads: disparity {:.2f}, v-disparity {:.2f}, merging {:.2f}, map {:.2f}\n",
             "", 1e-3 * times.disparity / stops, 1e-3 * times.v_disparity / stops, 1e-3 * times.merging / stops,
             map_seconds / stops);
  std::fflush(stdout);
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {{"--stops", "10"}, {"--list", "0"}});
  std::vector<std::string>& scenarios = arguments.scenarios;
  if (scenarios.empty()) scenarios = {"rocky_20pct", "crater_rim", "flat_featureless", "diffuse_200lux"};
  fmt::print("{:<18} {:<10} {:>7} {:>7} {:>9} {:>12} {:>9} {:>12}\n", "scenario", "range", "bias mm", "RMS mm",
             "covered %", "obstacles", "false %", "cavities");
  for (const std::string& scenario : scenarios) {
    judge(arguments.folder, scenario, arguments.number("--stops"), arguments.number("--list") != 0);
  }
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
