#include "spartan/system/run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"
#include "spartan/core/stage_clock.h"
#include "spartan/core/trajectory.h"
#include "spartan/system/internal/map_scale.h"
#include "spartan/system/internal/row_alignment.h"
#include "spartan/system/internal/run_loop.h"
#include "spartan/system/internal/summary.h"
#include "spartan/system/map_files.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan {

using namespace internal;

namespace {

void report_sequence(const RecordingInfo& info, const Log& log) {
  const SequenceReport& s = info.sequence;
  log.info(fmt::format("{}: {} recording ({}), rig from {}, {} stereo frames", info.path, name_of(info.format),
                       info.layout_reason, info.rig_source, s.announced));
  for (const std::string& warning : s.warnings) log.warning(warning);
  for (const std::string& remark : s.remarks) log.info(remark);
  if (s.orphans_left + s.orphans_right > 0) {
    log.warning(
        fmt::format("{} left and {} right images have no image of the other camera within the pairing tolerance",
                    s.orphans_left, s.orphans_right));
  }
  if (s.reversals > 0)
    log.warning(fmt::format("{} time stamps are not in increasing order; their frames are skipped", s.reversals));
  if (s.gaps > 0) {
    log.warning(fmt::format("{} gaps between frames, the longest {:.2f} s (median interval {:.3f} s)", s.gaps,
                            s.longest_gap_s, s.median_step_s));
  }
}

Result<RunStore> open_store(const RunRequest& request, const RunFolder& folder, const RunIdentity& identity) {
  if (request.resume) {
    const auto exists = RunStore::contains_run(folder.store());
    if (!exists) return failure(exists);
    if (*exists) return RunStore::resume(folder.store(), identity);
  }
  return RunStore::create(folder.store(), identity);
}

Status write_map(GlobalMap& map, const MapOptions& options, bool x_is_east, const ThreadPool& workers,
                 const RunFolder& folder, const Log& log) {
  if (map.extent().cells() > GlobalMap::kMostCells) {
    log.warning("the global map is too large for one image; `spartan map export --window` exports a part of it");
    return remove_map_files(folder.global_map());  // of the run before it was resumed
  }
  return write_global_map(map, options, x_is_east, workers, folder.global_map());
}

// Stages that the options disable.
std::vector<std::string> disabled_stages(const RunOptions& options) {
  std::vector<std::string> absent;
  if (options.odometry_only) absent = {"localization", "slam"};
  if (options.odometry_only || !options.maps) absent.emplace_back("maps");
  if (options.odometry_only || !options.terrain.enabled) absent.emplace_back("terrain");
  return absent;
}

// Stops need frames of another pair than that of the odometry.
MapSource map_source(const FrameSource& source, const RunOptions& options) {
  const Rig& rig = source.info().rig;
  const StereoPair* const odometry = odometry_pair_of(rig, options);
  if (options.maps_from != MapSource::automatic || odometry == nullptr) return options.maps_from;
  const bool stops = std::any_of(rig.pairs.begin(), rig.pairs.end(), [&](const StereoPair& pair) {
    return pair.name != odometry->name && !source.listed_stamps(pair.name).empty();
  });
  return stops ? MapSource::stops : MapSource::keyframes;
}

// Says why a run that should make maps has made none.
void report_missing_maps(const RunOptions& options, bool complete, const Log& log) {
  if (!options.maps || options.odometry_only) return;
  if (!complete) {
    log.info("no map yet: the run ended before the map of the first stop or keyframe was complete");
  } else if (options.maps_from == MapSource::stops) {
    log.warning(
        "no map: no stop has a view of another pair than that of the odometry; `--set maps_from=keyframes` maps "
        "single frames of that pair");
  } else {
    log.warning("no map: no frame could be tracked");
  }
}

// Trajectories and maps are written from the store alone, so a resumed run writes the same bytes.
Result<RunOutcome> write_results(RunLoop& run_loop, const RunOptions& options, const ThreadPool& workers,
                                 const RunFolder& folder, RunFacts facts, const Log& log) {
  const auto frames = run_loop.store().frames();
  if (!frames) return failure(frames);
  for (const TrajectoryKind kind : kTrajectoriesBestFirst) {
    if (options.odometry_only && kind != TrajectoryKind::odometry) continue;
    if (Status s = write_file_atomically(folder.trajectory(kind), to_tum(trajectory_of(*frames, kind))); !s)
      return failure(s);
  }
  if (Status s = write_map(run_loop.global_map(), options.mapping.map, run_loop.heading_east(), workers, folder, log);
      !s) {
    return failure(s);
  }
  facts.peak_memory_bytes = peak_memory_bytes();
  RunOutcome outcome;
  outcome.summary_json = to_summary_json(facts, *frames);
  outcome.lost = !lost_spans(*frames).empty();
  outcome.interrupted = run_loop.stopped();
  if (Status s = write_file_atomically(folder.summary(), outcome.summary_json); !s) return failure(s);
  return outcome;
}

void report_sensor_rows(const FrameSource& source, const Log& log) {
  if (const std::int64_t rows = source.sensor_samples_discarded(); rows > 0)
    log.warning(fmt::format("{} sensor samples discarded: their time stamps are not in increasing order", rows));
  const UnreadableRows unreadable = source.unreadable_sensor_rows();
  if (unreadable.count > 0) {
    log.warning(fmt::format("{} rows of sensor tables discarded: they cannot be parsed; the first: {}",
                            unreadable.count, unreadable.first));
  }
}

// "z is the normal of the ground in the first images (body pitched 33.6 deg down, rolled 2.8 deg to the left)"
std::string level_text(const Eigen::Vector3d& up_in_body) {
  const double pitch = std::atan2(-up_in_body.x(), std::hypot(up_in_body.y(), up_in_body.z())) / kRadiansPerDegree,
               roll = std::atan2(up_in_body.y(), up_in_body.z()) / kRadiansPerDegree;
  return fmt::format(
      "z is the normal of the ground in the first images (body pitched {:.1f} deg {}, rolled {:.1f} deg "
      "to the {})",
      std::abs(pitch), pitch >= 0 ? "down" : "up", std::abs(roll), roll >= 0 ? "right" : "left");
}

Result<RunOutcome> run_recording(const RunRequest& request, const RunHooks& given_hooks) {
  const auto start = std::chrono::steady_clock::now();
  const double start_cpu_s = cpu_seconds();
  auto source = open_recording(request.input, request.open);
  if (!source) return failure(source);
  const RecordingInfo& info = (*source)->info();

  const RunFolder folder{request.output};
  const std::string mask_folder = std::filesystem::path(info.rig_source).parent_path().string();
  RunOptions options = request.options;
  options.maps_from = map_source(**source, options);
  if (options.gravity_m_s2 == 0) options.gravity_m_s2 = info.gravity_m_s2.value_or(0);
  if (options.use_specified_noise) {
    options.localization =
        with_specified_noise(options.localization, info.noise, request.given.in_group("localization"));
  }
  const ThreadPool workers(request.threads);
  auto pipeline = Pipeline::create(info.rig, options, workers, mask_folder);
  if (!pipeline) return failure(pipeline);
  if (Status fits = pipeline->check_memory(request.memory_bytes); !fits) return failure(fits);
  // Aligning rows takes seconds.
  if (Status usable = check_run_folder(folder, request.resume || request.replace); !usable) return failure(usable);
  auto aligned = options.align_rows && options.imaging.rectify ? align_rows_of(**source, workers)
                                                               : Result<AlignedRig>(AlignedRig{info.rig, {}});
  if (!aligned) return failure(aligned);
  const Rig& rig = aligned->rig;
  if (!aligned->sentences.empty()) pipeline = Pipeline::create(rig, options, workers, mask_folder);
  if (!pipeline) return failure(pipeline);
  std::string map_text;
  const bool makes_maps = options.maps && !options.odometry_only;
  // A camera without a body frame and an IMU: its axes do not tell where up is. The odometry alone computes no
  // disparity image.
  const bool unknown_up = rig.convention == PoseConvention::left_optical && !info.has_imu && !options.odometry_only;
  std::optional<Eigen::Vector3d> ground_up;
  if (makes_maps || unknown_up) {
    const auto scale = map_scale_of(**source, rig, options, workers, mask_folder);
    if (!scale) return failure(scale);
    if (unknown_up) ground_up = scale->up_in_body;
    if (makes_maps) {
      options = with_map_scale(options, *scale, request.given);
      map_text = to_text(*scale, options);
      pipeline = Pipeline::create(rig, options, workers, mask_folder);
      if (!pipeline) return failure(pipeline);
    }
  }
  if (ground_up) pipeline->align_with_ground(*ground_up);
  auto replaced = request.replace ? replace_run_folder(folder) : Result<ReplacedFolder>();
  if (!replaced) return failure(replaced);
  auto prepared = prepare_run_folder(folder, request.resume);
  if (!prepared) return failure(prepared);
  RunHooks hooks = given_hooks;
  hooks.log = given_hooks.log.with_file(folder.log());
  report_sequence(info, hooks.log);
  for (const std::string& sentence : aligned->sentences) hooks.log.info(sentence);
  if (!map_text.empty()) hooks.log.info("local maps: " + map_text);
  if (ground_up) hooks.log.info("world: " + level_text(*ground_up));
  if (options.odometry_only) hooks.log.info("odometry only: no localization, no maps, no SLAM, no terrain");
  const auto listing = (*source)->listing_hash();
  if (!listing) return failure(listing);
  const RunIdentity identity{fmt::format("{:016x}", *listing), dump_options(options), to_rig_yaml(rig)};
  auto store = open_store(request, folder, identity);
  if (!store) return failure(store);
  if (Status s = write_file_atomically(folder.config(), identity.options); !s) return failure(s);
  if (Status s = write_file_atomically(folder.rig(), identity.rig); !s) return failure(s);

  RunLoop run_loop(request, hooks, **source, std::move(*pipeline), std::move(*store), folder, start, start_cpu_s);
  if (Status s = run_loop.begin(); !s) return failure(s);
  const Status processed = run_loop.process_samples();
  if (run_loop.usable_frames() > 0) replaced->discard();
  if (!processed) return failure(processed);
  report_sensor_rows(**source, hooks.log);
  if (run_loop.usable_frames() == 0 && !run_loop.stopped()) {
    // An empty run folder would block the next attempt.
    if (prepared->state == FolderState::created) remove_run_folder(folder);
    return failure(ErrorCode::input, "the recording has no usable frame; first error: " + run_loop.first_error(),
                   info.path);
  }

  RunFacts facts;
  if (run_loop.global_map().stops().empty()) report_missing_maps(options, run_loop.complete(), hooks.log);
  facts.version = request.version;
  facts.input = info.path;
  facts.format = name_of(info.format);
  facts.gravity_measured = run_loop.gravity_measured();
  facts.level_by_ground = ground_up.has_value();
  if (!facts.gravity_measured) {
    hooks.log.warning(
        "the vertical was not measured: z of the world is the up axis of the body at the start, and maps are tilted "
        "with it");
  }
  facts.heading_east = run_loop.heading_east();
  facts.threads = request.threads;
  facts.absent = disabled_stages(options);
  facts.sensor_rows_reversed = (*source)->sensor_samples_discarded();
  facts.sensor_rows_unreadable = (*source)->unreadable_sensor_rows().count;
  facts.resumed_from_frame = run_loop.resumed_from_frame();
  const ElapsedTime elapsed = run_loop.elapsed();
  facts.wall_seconds = elapsed.wall_s;
  facts.cpu_seconds = elapsed.cpu_s;
  auto outcome = write_results(run_loop, resolved_options(options, rig), workers, folder, facts, hooks.log);
  if (outcome) outcome->lock = std::move(prepared->lock);
  return outcome;
}

}  // namespace

Result<RunOutcome> run(const RunRequest& request, const RunHooks& hooks) {
  try {
    return run_recording(request, hooks);
  } catch (const std::bad_alloc& exception) {
    return tl::unexpected(out_of_memory(exception));
  }
}

}  // namespace spartan
