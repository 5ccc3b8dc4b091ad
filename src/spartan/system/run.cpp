#include "spartan/system/run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <new>
#include <optional>
#include <utility>
#include <vector>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/camera/recording_writer.h"
#include "spartan/core/files.h"
#include "spartan/core/stage_clock.h"
#include "spartan/core/trajectory.h"
#include "spartan/system/internal/continued_stream.h"
#include "spartan/system/internal/exposure_stage.h"
#include "spartan/system/internal/panorama.h"
#include "spartan/system/internal/pipeline_state.h"
#include "spartan/system/internal/queued_stream.h"
#include "spartan/system/internal/run_loop.h"
#include "spartan/system/internal/run_setup.h"
#include "spartan/system/internal/smoothed_trajectory.h"
#include "spartan/system/internal/summary.h"
#include "spartan/system/map_files.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan {

using namespace internal;

namespace {

// Images of a live stream that wait to be processed, at most: some 100 frames of 1120 x 1120 px.
constexpr std::size_t kQueueBytes = std::size_t{256} << 20U;

// Of the global map, that a live run writes where it is stopped: some 0.5 s.
constexpr std::int64_t kMostCellsAtOnce = 250'000;

// Where the samples come from.
struct RunSource {
  SampleStream& stream;
  Recording* recording;  // the stream, if it is one; null: live
  QueuedStream* queue;   // through which a live stream is read
  Panorama* panorama;    // null: there are none

  Pace pace() const { return recording ? Pace::recorded : Pace::live; }
};

// What a live run has recorded until it was interrupted.
Result<std::vector<std::unique_ptr<Recording>>> recordings_of(const RunFolder& folder, const Log& log) {
  std::vector<std::unique_ptr<Recording>> recordings;
  OpenOptions accepted;
  accepted.unfinished = true;
  accepted.pair_tolerance_s = std::numeric_limits<double>::infinity();  // the stream has paired its images
  std::error_code error;
  for (int i = 1; std::filesystem::exists(folder.recording(i), error); ++i) {
    auto recording = open_recording(folder.recording(i), accepted);
    // Such as one that was interrupted before it listed a frame.
    if (!recording && recording.error().code == ErrorCode::input) {
      log.warning("a recording of this run is not processed: " + recording.error().message());
      continue;
    }
    if (!recording) return failure(recording);
    recordings.push_back(std::move(*recording));
  }
  return recordings;
}

// The folder of the recording that is to be made.
std::string next_recording(const RunFolder& folder) {
  std::error_code error;
  int number = 1;
  while (std::filesystem::exists(folder.recording(number), error)) ++number;
  return folder.recording(number);
}

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

Status write_map(GlobalMap& map, const MapOptions& options, bool x_is_east, bool at_once, const ThreadPool& workers,
                 const RunFolder& folder, const Log& log) {
  const std::int64_t cells = map.extent().cells();
  if (cells > GlobalMap::kMostCells || (at_once && cells > kMostCellsAtOnce)) {
    log.warning(cells > GlobalMap::kMostCells
                    ? "the global map is too large for one image; `spartan map export --window` exports a part of it"
                    : "the files of the global map would take seconds; `spartan map export` writes them");
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
  for (const TrajectoryKind kind : kTrajectories) {
    if (options.odometry_only && kind != TrajectoryKind::odometry) continue;
    if (kind == TrajectoryKind::smoothed && !has_trajectory(*frames, kind)) {
      std::error_code ignored;
      std::filesystem::remove(folder.trajectory(kind), ignored);  // of the run before it was resumed
      continue;
    }
    if (Status s = write_file_atomically(folder.trajectory(kind), to_tum(trajectory_of(*frames, kind))); !s)
      return failure(s);
  }
  const bool at_once = facts.live && run_loop.stopped();
  if (Status s =
          write_map(run_loop.global_map(), options.mapping.map, run_loop.heading_east(), at_once, workers, folder, log);
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

RunFacts facts_of(const RunRequest& request, const RunSource& source, const RunOptions& options,
                  const RunLoop& run_loop) {
  RunFacts facts;
  facts.version = request.version;
  facts.input = source.stream.info().path;
  facts.format = source.recording ? name_of(source.recording->info().format) : "live";
  if (source.queue) {
    facts.live = LiveFacts{run_loop.latencies(), source.queue->dropped(), source.queue->peak_bytes(), 0, {}};
    facts.live->cameras = source.queue->camera_reports();
    if (StreamRecorder* const recorder = source.queue->recorder()) facts.live->recording = recorder->progress();
  }
  facts.gravity_measured = run_loop.gravity_measured();
  facts.heading_east = run_loop.heading_east();
  facts.slip_alarm = options.localization.wheels.slip_alarm;
  facts.threads = request.threads;
  facts.absent = disabled_stages(options);
  facts.sensor_rows_reversed = source.stream.discarded().reversed;
  facts.sensor_rows_unreadable = source.stream.discarded().unreadable;
  facts.resumed_from_frame = run_loop.resumed_from_frame();
  const RecorderStatistics recorder = run_loop.recorder_statistics();
  facts.commits = recorder.commits;
  if (facts.live) facts.live->files_discarded = recorder.files_discarded;
  const ElapsedTime elapsed = run_loop.elapsed();
  facts.wall_seconds = elapsed.wall_s;
  facts.cpu_seconds = elapsed.cpu_s;
  return facts;
}

void report_dropped(const QueuedStream& queue, const Log& log) {
  const DroppedFrames dropped = queue.dropped();
  if (dropped.odometry + dropped.views + dropped.sensor_samples == 0) return;
  log.warning(
      fmt::format("{} frames of the odometry, {} views of other pairs and {} sensor samples were dropped: they "
                  "arrived faster than they were processed",
                  dropped.odometry, dropped.views, dropped.sensor_samples));
}

// A run goes on where its stream cannot be recorded.
void end_recording(QueuedStream& queue, const Log& log) {
  queue.stop();
  StreamRecorder* const recorder = queue.recorder();
  if (recorder == nullptr) return;
  if (const Status finished = recorder->finish(); !finished)
    log.error("the recording ends before the run: " + finished.error().message());
  const RecorderProgress progress = recorder->progress();
  if (progress.dropped > 0)
    log.warning(fmt::format("{} frames were not recorded: the disk is too slow", progress.dropped));
  if (progress.rejected > 0)
    log.warning(fmt::format("{} samples were not recorded: a recording cannot hold them", progress.rejected));
}

// What follows takes longer the longer the run was, and can be done again with --resume or `spartan export`.
void report_stop(const RunLoop& run_loop, const Log& log) {
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - run_loop.stop_time();
  log.info(fmt::format("stopped: all results are committed after {:.2f} s; writing the other files", since.count()));
}

// A live stream is never the same twice.
Result<std::string> fingerprint_of(const RunSource& source) {
  if (!source.recording) return source.stream.info().path;
  const auto listing = source.recording->listing_hash();
  if (!listing) return failure(listing);
  return fmt::format("{:016x}", *listing);
}

// The live run that is to be resumed. None: there is none, or it is another one, which opening its store says.
Result<std::optional<RunIdentity>> live_run_before(const StreamInfo& info, const std::string& output) {
  const RunFolder folder{output};
  if (Status free = check_run_folder(folder, true); !free) return failure(free);
  auto before = RunStore::identity_of(folder.store());
  if (!before) return failure(before);
  const bool is_this = *before && (*before)->input == info.path && !(*before)->given_rig.empty();
  return is_this ? std::move(*before) : std::nullopt;
}

struct RunStart {
  std::chrono::steady_clock::time_point time = std::chrono::steady_clock::now();
  double cpu_s = cpu_seconds();
};

Result<RunOutcome> run_source(const RunSource& source, const RunStart& start, const RunRequest& request,
                              const RunHooks& given_hooks) {
  const StreamInfo& info = source.stream.info();
  const ThreadPool workers(request.threads);
  const auto before =
      source.queue && request.resume ? live_run_before(info, request.output) : Result<std::optional<RunIdentity>>();
  if (!before) return failure(before);
  auto setup = set_up_run(source.stream, request, workers, source.pace(), *before ? &**before : nullptr);
  if (!setup) return failure(setup);
  const Rig& rig = setup->rig;
  const RunOptions& options = setup->options;
  const RunFolder folder{request.output};
  auto replaced = request.replace ? replace_run_folder(folder) : Result<ReplacedFolder>();
  if (!replaced) return failure(replaced);
  auto prepared = prepare_run_folder(folder, request.resume);
  if (!prepared) return failure(prepared);
  RunHooks hooks = given_hooks;
  const LogFile log_file = hooks.log.attach_file(folder.log());  // also of what cameras and the pan-tilt unit say
  if (source.recording) report_sequence(source.recording->info(), hooks.log);
  for (const std::string& sentence : setup->sentences) hooks.log.info(sentence);
  if (options.odometry_only) hooks.log.info("odometry only: no localization, no maps, no SLAM, no terrain");
  auto fingerprint = fingerprint_of(source);
  if (!fingerprint) return failure(fingerprint);
  RunIdentity identity{std::move(*fingerprint), dump_options(options), to_rig_yaml(rig)};
  if (source.queue) {
    identity.given_options = dump_options(request.options);
    identity.given_rig = to_rig_yaml(info.rig);
    identity.given_keys = fmt::format("{}", fmt::join(request.given.keys(), " "));
    identity.ground_up = setup->ground_up;
  }
  auto store = open_store(request, folder, identity);
  if (!store) return failure(store);
  if (source.recording) {
    RunInput input{request.input, request.open};
    input.open.format = source.recording->info().format;
    if (Status s = write_run_input(input, folder); !s) return failure(s);
  }
  if (Status s = write_file_atomically(folder.config(), identity.options); !s) return failure(s);
  const auto stored_rig = with_self_masks_in(folder.path, rig, info.mask_folder());
  if (!stored_rig) return failure(stored_rig);
  if (Status s = write_file_atomically(folder.rig(), to_rig_yaml(*stored_rig)); !s) return failure(s);

  auto recorder = RunRecorder::create(std::move(*store), folder, options, source.pace());
  if (!recorder) return failure(recorder);
  std::optional<ResumedStream> resumed;
  if (source.queue && request.resume) {
    auto recordings = recordings_of(folder, hooks.log);
    if (!recordings) return failure(recordings);
    resumed.emplace(std::move(*recordings), *source.queue);
  }
  if (source.queue && request.record) {
    auto recorded = StreamRecorder::create(next_recording(folder), info, request.recorded_images);
    if (!recorded) return failure(recorded);
    source.queue->record_with(std::move(*recorded));
  }
  SampleStream& live = source.queue ? *source.queue : source.stream;
  std::optional<ExposureStage> exposure;
  if (live.control() != nullptr && options.exposure.enabled) {
    auto created = ExposureStage::create(rig, options.exposure, info.mask_folder(), *live.control(), hooks.log);
    if (!created) return failure(created);
    exposure.emplace(std::move(*created));
  }
  const RunStream stream{resumed ? *resumed : live,       source.recording,
                         resumed ? &*resumed : nullptr,   source.queue ? source.queue->recorder() : nullptr,
                         exposure ? &*exposure : nullptr, source.panorama};
  RunLoop run_loop(request, hooks, stream, std::move(setup->pipeline), std::move(*recorder), start.time, start.cpu_s);
  if (Status s = run_loop.begin(); !s) return failure(s);
  const Status processed = run_loop.process_samples();
  if (run_loop.usable_frames() > 0) replaced->discard();
  if (source.queue) end_recording(*source.queue, hooks.log);
  if (!processed) return failure(processed);
  if (run_loop.stopped()) report_stop(run_loop, hooks.log);
  for (const std::string& line : describe(source.stream.discarded())) hooks.log.warning(line);
  if (source.queue) report_dropped(*source.queue, hooks.log);
  for (const CameraPairReport& report : source.stream.camera_reports()) hooks.log.info(describe(report));
  if (run_loop.usable_frames() == 0 && !run_loop.stopped()) {
    // An empty run folder would block the next attempt.
    if (prepared->state == FolderState::created) remove_run_folder(folder);
    return failure(ErrorCode::input, "there is no usable frame; first error: " + run_loop.first_error(), info.path);
  }

  if (run_loop.global_map().stops().empty()) report_missing_maps(options, run_loop.complete(), hooks.log);
  if (!run_loop.gravity_measured()) {
    hooks.log.warning(
        "the vertical was not measured: z of the world is the up axis of the body at the start, and maps are tilted "
        "with it");
  }
  const RunOptions resolved = resolved_options(options, rig);
  if (options.smoothed_trajectory && !options.odometry_only && !run_loop.stopped()) {
    if (Status s = write_smoothed_trajectory(run_loop.store(), with_gravity(resolved), hooks.log); !s)
      return failure(s);
  }
  RunFacts facts = facts_of(request, source, options, run_loop);
  if (facts.live && exposure) facts.live->exposure = exposure->statistics();
  facts.level_by_ground = setup->ground_up.has_value();
  auto outcome = write_results(run_loop, resolved, workers, folder, std::move(facts), hooks.log);
  if (outcome) outcome->lock = std::move(prepared->lock);
  return outcome;
}

// A stream that can be repeated gives the same results on any computer.
std::chrono::nanoseconds longest_wait(const SampleStream& stream, const RunOptions& options) {
  if (stream.is_repeatable()) return {};
  return std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 * options.longest_wait_s));
}

// Null where none is wanted. `unit`: null where there is none.
Result<std::unique_ptr<Panorama>> panorama_of(SampleStream& stream, PanTiltControl* unit, const RunRequest& request,
                                              const RunHooks& hooks) {
  const bool wanted = request.options.panorama.every_m > 0;
  if (unit == nullptr && wanted) {
    return failure(ErrorCode::usage, "has no pan-tilt unit, which a panorama needs", stream.info().path,
                   "name one with --pan-tilt");
  }
  if (unit == nullptr || (!wanted && !hooks.command)) return nullptr;
  const Rig& rig = stream.info().rig;
  const StereoPair* const odometry = odometry_pair_of(rig, request.options);
  return Panorama::create(rig, odometry == nullptr ? "" : odometry->name, request.options.panorama, *unit,
                          stream.control(), hooks);
}

// The error of the unit adds to that of its calibration in the variance of the maps.
RunOptions with_unit_error(RunOptions options, const Rig& rig, const PanTiltControl& unit) {
  if (!(unit.sigma_rad() > 0)) return options;
  double& pan_tilt_deg = options.mapping.map.calibration.pan_tilt_deg;
  if (pan_tilt_deg == CalibrationErrors().pan_tilt_deg && rig.calibration_errors)
    pan_tilt_deg = rig.calibration_errors->pan_tilt_deg;
  pan_tilt_deg = std::hypot(pan_tilt_deg, unit.sigma_rad() / kRadiansPerDegree);
  return options;
}

// The last commit cannot notice that the store is removed while SQLite closes it.
Result<RunOutcome> with_store(Result<RunOutcome> outcome, const std::string& store) {
  if (!outcome) return outcome;
  const auto there = RunStore::contains_run(store);
  // It was written a moment ago: what hinders reading now concerns the output.
  if (!there && there.error().code == ErrorCode::read_error)
    return failure(ErrorCode::output, there.error().what, store, there.error().hint);
  if (!there) return failure(there);
  if (*there) return outcome;
  return failure(ErrorCode::output, "was removed or replaced during the run", store, "run again into a new folder");
}

}  // namespace

Result<RunOutcome> run(const RunRequest& request, const RunHooks& hooks) {
  const RunStart start;
  try {
    const auto recording = open_recording(request.input, request.open);
    if (!recording) return failure(recording);
    return with_store(run_source({**recording, recording->get(), nullptr, nullptr}, start, request, hooks),
                      RunFolder{request.output}.store());
  } catch (const std::bad_alloc& exception) {
    return tl::unexpected(out_of_memory(exception));
  }
}

Result<RunOutcome> run_live(SampleStream& stream, const RunRequest& request, const RunHooks& hooks) {
  const RunStart start;
  RunRequest wanted = request;
  const StereoPair* const odometry = odometry_pair_of(stream.info().rig, request.options);
  try {
    auto named = request.pan_tilt.empty() ? std::unique_ptr<PanTiltControl>() : open_pan_tilt(request.pan_tilt);
    if (!named) return failure(named);
    PanTiltControl* const unit = *named ? named->get() : stream.pan_tilt();
    if (unit != nullptr) wanted.options = with_unit_error(request.options, stream.info().rig, *unit);
    ContinuedStream continued(stream, hooks.log);
    auto panorama = panorama_of(continued, unit, wanted, hooks);
    if (!panorama) return failure(panorama);
    std::optional<PanoramaStream> labelled;
    if (*panorama) labelled.emplace(continued, **panorama);
    SampleStream& samples = labelled ? static_cast<SampleStream&>(*labelled) : continued;
    QueuedStream queue(samples, odometry ? odometry->name : "", kQueueBytes, longest_wait(samples, request.options));
    return with_store(run_source({samples, nullptr, &queue, panorama->get()}, start, wanted, hooks),
                      RunFolder{request.output}.store());
  } catch (const std::bad_alloc& exception) {
    return tl::unexpected(out_of_memory(exception));
  }
}

}  // namespace spartan
