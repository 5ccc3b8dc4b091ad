// Global maps of simulated drives against ground truth: of keyframes of the narrow pair alone, and of the stops with
// all views. `make bench-mars_keyframes`.
//
//   mars_keyframes [--from FOLDER] SCENARIO...
//
// Uses recordings from scripts/recordings. Default: rocky_20pct, crater_rim, flat_featureless, diffuse_200lux. Poses
// are the true ones, so that only the maps are evaluated. Cells count within 4 m of a view.
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "mars_scores.h"
#include "mars_stops.h"
#include "spartan/core/stage_clock.h"
#include "spartan/slam/global_map.h"
#include "spartan/system/internal/keyframe_stage.h"
#include "spartan/system/run_options.h"
#include "standard_recordings.h"

namespace spartan {
namespace {

constexpr const char* kPair = "narrow";
constexpr double kFarthest_m = 4;

// A local map is made of each group: the views of a stop, or a keyframe.
using Groups = std::vector<std::vector<FrameKey>>;

Groups stops_of(const Drive& drive) {
  Groups groups;
  for (const auto& [position, frames] : drive.stops) groups.push_back(frames);
  return groups;
}

Groups keyframes_of(Drive& drive, Imager& imager) {
  const RunOptions options;
  internal::KeyframeStage stage(StopMapper::create({}, {}, ThreadPool(1)).value(), options.keyframes,
                                options.mapping.map.extent_m);
  Groups groups;
  for (const Stamp stamp : drive.source->listed_stamps(kPair)) {
    const auto frame = drive.source->frame_at(kPair, stamp);
    if (!frame) continue;
    const auto rectified = imager.process(*frame);
    if (!rectified) continue;
    const Pose world_from_left = true_pose(drive, stamp) * rectified->body_from_left;
    if (!stage.is_due(*rectified, world_from_left)) continue;
    stage.begin(*rectified, world_from_left, {}, {});
    stage.clear();
    groups.push_back({{kPair, stamp}});
  }
  return groups;
}

struct GroupView {
  std::string pair;
  Stamp stamp;
  ViewGeometry geometry;
  Pose world_from_body;
};

void evaluate(Drive& drive, Imager& imager, const std::string& scenario, const char* product, const Groups& groups) {
  const RunOptions options;
  StopMapper mapper = StopMapper::create({}, {}, ThreadPool(2)).value();
  GlobalMap global = GlobalMap::create(options.slam.map, options.mapping.map.cell_m).value();
  std::vector<GroupView> views;
  for (const std::vector<FrameKey>& frames : groups) {
    add_views(drive, imager, mapper, frames);
    const MergedRange merged = mapper.merge();
    const Pose pose = true_pose(drive, frames.front().left_stamp);
    const LocalMap local = mapper.map(surface_points(merged), pose);
    if (!global.add(local, frames.front().left_stamp, {pose, Matrix6d::Zero()}, Matrix6d::Zero())) return;
    for (const StopView& view : mapper.views()) views.push_back({view.pair, view.stamp, view.geometry, pose});
  }
  const auto map = global.view(global.extent());
  if (!map) return;
  const GeoTransform place = map->window.place(map->cell_m);
  Visibility visibility(map->window.size());
  for (const GroupView& view : views)
    add_true_view(drive, view.pair, view.stamp, view.geometry, view.world_from_body, place, visibility, kFarthest_m);
  MapMetricsOptions scoring;
  scoring.farthest_m = 1e6;
  const DriveTruth truth(drive);
  Sums sums;
  sums.add(evaluate_map({place, map->elevation_m, class_band(map->kind), visibility.pixels, visibility.lowest_m},
                        truth.view(), scoring));
  print_row(scenario, product, sums);
  fmt::print("{:<18} {:<10} {} local maps; {:.1f} m² visible\n", "", "", groups.size(),
             sums.visible * map->cell_m * map->cell_m);
  std::fflush(stdout);
}

void run(const std::vector<std::string>& words) {
  RecordingArguments arguments = read_arguments(words, {});
  std::vector<std::string>& scenarios = arguments.scenarios;
  if (scenarios.empty()) scenarios = {"rocky_20pct", "crater_rim", "flat_featureless", "diffuse_200lux"};
  print_header("product");
  for (const std::string& scenario : scenarios) {
    auto drive = open_drive(arguments.folder + "/" + scenario);
    if (!drive) {
      fmt::print("{:<18} skipped: {} (create it with scripts/recordings)\n", scenario, drive.error().message());
      continue;
    }
    auto imager = Imager::create(drive->rig, ImagingOptions(), ThreadPool(2));
    if (!imager) continue;
    evaluate(*drive, *imager, scenario, "stops", stops_of(*drive));
    evaluate(*drive, *imager, scenario, "keyframes", keyframes_of(*drive, *imager));
  }
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
