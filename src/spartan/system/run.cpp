#include "spartan/system/run.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <new>
#include <utility>
#include <vector>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"
#include "spartan/core/stage_clock.h"
#include "spartan/core/trajectory.h"
#include "spartan/system/internal/summary.h"
#include "spartan/system/internal/terrain_files.h"
#include "spartan/system/map_files.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan {

using namespace internal;

namespace {

// Length of the interval from the first IMU sample that initializes gravity if no sample comes before the first frame:
// a recording often starts its camera and its IMU together, while the rover is stationary. Empirical.
constexpr double kAlignmentSeconds = 1;

void report_sequence(const RecordingInfo& info, const Log& log) {
  const SequenceReport& s = info.sequence;
  log.info(fmt::format("{}: {} recording ({}), rig from {}, {} stereo frames", info.path, name_of(info.format),
                       info.layout_reason, info.rig_source, s.announced));
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

LocalizationRecord localization_record(const LocalizationEstimate& estimate) {
  LocalizationRecord record;
  record.world_from_body = estimate.world_from_body;
  record.odom_from_body = estimate.odom_from_body;
  if (estimate.slip) {
    record.slip = estimate.slip->slip;
    record.slip_sigma = estimate.slip->sigma;
  }
  for (std::size_t i = 0; i < estimate.health.size(); ++i) {
    const SensorHealth& health = estimate.health[i];
    record.sensors.push_back(
        {std::string(name_of(static_cast<LocalizationSensor>(i))), std::string(name_of(health.state)), health.reason});
  }
  return record;
}

// Feeds the samples of a recording to the pipeline and commits every result to the store.
class RunLoop {
 public:
  RunLoop(const RunRequest& request, const RunHooks& hooks, FrameSource& source, Pipeline pipeline, RunStore store,
          RunFolder folder)
      : request_(request),
        hooks_(hooks),
        source_(source),
        pipeline_(std::move(pipeline)),
        store_(std::move(store)),
        folder_(std::move(folder)) {}

  // Restores the state of the run to be resumed, or initializes a new one.
  Status begin();
  // Processes samples until the end, the frame limit or a request to stop.
  Status process_samples();
  int usable_frames() const { return usable_frames_; }
  // Error message of the first frame that was skipped.
  const std::string& first_error() const { return first_error_; }
  bool stopped() const { return stopped_; }
  bool gravity_measured() const { return pipeline_.gravity_measured(); }
  bool heading_east() const { return pipeline_.heading_east(); }
  std::optional<std::int64_t> resumed_from_frame() const { return resumed_from_frame_; }
  RunStore& store() { return store_; }
  GlobalMap& global_map() { return pipeline_.global_map(); }

 private:
  Status process(const Sample& sample);
  Status finish();
  Result<MapRecord> write_map_of(const MappedStop& stop);
  Status process_frame(const StereoFrame& frame);
  Status process_missing(const MissingFrame& missing);
  Status commit(const RunStore::Step& step);
  std::vector<StageTime> take_stage_times();

  const RunRequest& request_;
  const RunHooks& hooks_;
  FrameSource& source_;
  Pipeline pipeline_;
  RunStore store_;
  RunFolder folder_;
  StageClock clock_;
  std::vector<StageTime> view_times_;  // of views of a stop since the last frame of the odometry pair
  std::int64_t samples_taken_ = 0;     // number of samples read from the source
  int frames_ = 0;                     // frames of the odometry pair, missing ones included
  int usable_frames_ = 0;              // frames of the odometry pair that were processed
  std::string first_error_;
  bool stopped_ = false;
  bool resumed_ = false;
  std::optional<std::int64_t> resumed_from_frame_;
};

Status RunLoop::begin() {
  pipeline_.store_maps_in(store_.tiles());
  auto checkpoint = store_.checkpoint();
  if (!checkpoint) return failure(checkpoint);
  if (!*checkpoint) {
    const auto imu = source_.imu_samples({}, kAlignmentSeconds);
    if (!imu) return failure(imu);
    pipeline_.align_with_gravity(*imu);
    return {};
  }
  const auto frames = store_.frames();
  if (!frames) return failure(frames);
  if (frames->empty()) {
    return failure(ErrorCode::store_damaged, "is damaged: it has a saved state, but table 'frames' is empty",
                   folder_.store(), "run again into a new folder");
  }
  frames_ = static_cast<int>(frames->size());
  for (const FrameRecord& frame : *frames) usable_frames_ += frame.status != "missing";
  if (Status status = pipeline_.restore((*checkpoint)->pipeline_state, store_.tiles()); !status) return status;
  for (const FrameKey& key : pipeline_.pending_frames()) {
    const auto frame = source_.frame_at(key.pair, key.left_stamp);
    if (!frame) return failure(frame);
    if (Status status = pipeline_.restore_frame(*frame); !status) return status;
  }
  samples_taken_ = (*checkpoint)->source.samples_taken;
  resumed_ = true;
  hooks_.log.info(fmt::format("resuming after frame {}", frames->back().frame_id));
  if (Status sought = source_.seek(samples_taken_); !sought) return sought;
  if (source_.content_hash() == (*checkpoint)->source.content_hash) return {};
  return failure(ErrorCode::configuration,
                 "the recording is not the one that the run began with: an image or a row of a sensor table that was "
                 "processed has changed",
                 source_.info().path, "restore the recording, or run into a new folder");
}

Status RunLoop::process_samples() {
  while (request_.max_frames == 0 || frames_ < request_.max_frames) {
    if (hooks_.should_stop && hooks_.should_stop()) {
      stopped_ = true;
      return {};
    }
    const auto sample = clock_.measure("camera", [&] { return source_.next(); });
    if (!sample) return failure(sample);
    if (!*sample) return finish();
    ++samples_taken_;
    if (Status status = process(**sample); !status) return status;
  }
  return {};
}

// Commits what is complete only at the end of the recording: the map of the last stop and the stage times since the
// last frame.
Status RunLoop::finish() {
  clock_.take();  // discards the read attempt at the end of the recording
  auto stop = pipeline_.finish_stop();
  if (!stop) return failure(stop);
  RunStore::Step step;
  if (*stop) {
    const auto map = write_map_of(**stop);
    if (!map) return failure(map);
    step.map = *map;
  }
  step.times = take_stage_times();
  if (frames_ == 0 || (!step.map && step.times.empty())) return {};
  return commit(step);
}

std::vector<StageTime> RunLoop::take_stage_times() {
  std::vector<StageTime> times = std::exchange(view_times_, {});
  for (const std::vector<StageTime>& measured : {clock_.take(), pipeline_.take_stage_times()})
    times.insert(times.end(), measured.begin(), measured.end());
  return times;
}

Result<MapRecord> RunLoop::write_map_of(const MappedStop& stop) {
  const LocalMap& map = stop.merged.local;
  const Status written = clock_.measure("maps", [&] { return write_local_map(map, folder_.local_map(stop.stamp)); });
  if (!written) return failure(written);
  MapRecord record;
  record.stamp = stop.stamp;
  record.position_id = stop.position_id;
  record.views = stop.views;
  record.prior = stop.prior;
  record.world_from_body = stop.merged.corrected;
  record.status = name_of(stop.merged.match.status);
  record.overlap = stop.merged.match.overlap;
  record.obstacles = static_cast<int>(map.obstacles.size());
  for (int y = 0; y < map.size().height; ++y) {
    for (int x = 0; x < map.size().width; ++x) record.known_cells += map.count(x, y) > 0 ? 1 : 0;
  }
  return record;
}

Status RunLoop::process(const Sample& sample) {
  if (const auto* frame = std::get_if<StereoFrame>(&sample)) return process_frame(*frame);
  if (const auto* missing = std::get_if<MissingFrame>(&sample)) return process_missing(*missing);
  clock_.take();  // the summary does not list the time of reading sensor samples
  if (const auto* imu = std::get_if<ImuSample>(&sample)) pipeline_.add(*imu);
  if (const auto* wheels = std::get_if<WheelSample>(&sample)) pipeline_.add(*wheels);
  if (const auto* compass = std::get_if<CompassSample>(&sample)) pipeline_.add(*compass);
  if (const auto* inclinometer = std::get_if<InclinometerSample>(&sample)) pipeline_.add(*inclinometer);
  return {};
}

Status RunLoop::process_frame(const StereoFrame& frame) {
  auto result = pipeline_.add(frame);
  if (!result) {
    // A frame that does not fit the rig or repeats an image is reported, counted and skipped. Any other error ends the
    // run.
    if (result.error().code != ErrorCode::frame_rejected) return failure(result);
    return process_missing(
        {frame.frame_id, frame.pair, frame.left_stamp, pipeline_.fault_of(frame), result.error().message()});
  }
  if (!*result) {
    view_times_ = take_stage_times();
    return {};
  }
  FrameResult& output = **result;
  ++usable_frames_;
  RunStore::Step step;
  FrameRecord& record = step.frame.emplace();
  record.frame_id = output.frame_id;
  record.pair = output.pair;
  record.stamp = output.stamp;
  record.status = name_of(output.motion.status);
  record.message = output.motion.reason;
  record.has_pose = output.motion.status != TrackingStatus::lost;
  record.world_from_body = output.world_from_body;
  record.motion = output.motion;
  record.slam = output.slam;
  if (output.localization) record.localization = localization_record(*output.localization);
  if (output.motion.status == TrackingStatus::lost) {
    hooks_.log.warning(fmt::format("frame {}: odometry lost: {}", output.frame_id, output.motion.reason));
  }
  if (output.terrain) {
    auto written = clock_.measure(
        "terrain", [&] { return write_terrain(*output.terrain, request_.options.terrain, folder_.terrain()); });
    if (!written) return failure(written);
    step.terrain = *written;
  }
  if (output.stop) {
    const auto map = write_map_of(*output.stop);
    if (!map) return failure(map);
    step.map = *map;
  }
  record.times = take_stage_times();
  record.times.insert(record.times.end(), output.times.begin(), output.times.end());
  return commit(step);
}

Status RunLoop::process_missing(const MissingFrame& missing) {
  hooks_.log.warning(
      fmt::format("frame {} skipped ({}): {}", missing.frame_id, name_of(missing.fault), missing.message));
  clock_.take();
  if (first_error_.empty()) first_error_ = missing.message;
  if (missing.pair != pipeline_.odometry_pair()) return {};
  RunStore::Step step;
  FrameRecord& record = step.frame.emplace();
  record.frame_id = missing.frame_id;
  record.pair = missing.pair;
  record.stamp = missing.stamp;
  record.status = "missing";
  record.fault = name_of(missing.fault);
  record.message = missing.message;
  record.world_from_body.pose = pipeline_.predict(missing.stamp).value_or(Pose());
  record.times = take_stage_times();
  return commit(step);
}

Status RunLoop::commit(const RunStore::Step& step) {
  if (resumed_ && !resumed_from_frame_ && step.frame) resumed_from_frame_ = step.frame->frame_id;
  const auto save = [&]() -> Result<Bytes> {
    if (Status flushed = pipeline_.flush_maps(); !flushed) return failure(flushed);
    return pipeline_.save();
  };
  Status status = store_.commit(step, save, {samples_taken_, source_.content_hash()});
  if (!step.frame) return status;
  ++frames_;
  if (status && hooks_.progress) hooks_.progress({frames_, source_.info().sequence.announced, step.frame->status});
  return status;
}

Result<RunStore> open_store(const RunRequest& request, const RunFolder& folder, const RunIdentity& identity) {
  if (request.resume) {
    const auto exists = RunStore::contains_run(folder.store());
    if (!exists) return failure(exists);
    if (*exists) return RunStore::resume(folder.store(), identity);
  }
  return RunStore::create(folder.store(), identity);
}

Status write_map(GlobalMap& map, const RunRequest& request, const Rig& rig, const RunFolder& folder, const Log& log) {
  if (map.extent().cells() > GlobalMap::kMostCells) {
    log.warning("the global map is too large for one image; `spartan map export --window` exports a part of it");
    return remove_map_files(folder.global_map());  // of the run before it was resumed
  }
  const RunOptions options = resolved_options(request.options, rig);
  return write_global_map(map, options.mapping.map, ThreadPool(request.threads), folder.global_map());
}

// Stages that the options disable.
std::vector<std::string> disabled_stages(const RunOptions& options) {
  std::vector<std::string> absent;
  if (options.odometry_only) absent = {"localization", "slam"};
  if (options.odometry_only || !options.maps) absent.emplace_back("maps");
  if (options.odometry_only || !options.terrain.enabled) absent.emplace_back("terrain");
  return absent;
}

// Trajectories and maps are written from the store alone, so a resumed run writes the same bytes.
Result<RunOutcome> write_results(RunLoop& run_loop, const RunRequest& request, const Rig& rig, const RunFolder& folder,
                                 RunFacts facts, const Log& log) {
  const auto frames = run_loop.store().frames();
  if (!frames) return failure(frames);
  for (const TrajectoryKind kind : kTrajectoriesBestFirst) {
    if (request.options.odometry_only && kind != TrajectoryKind::odometry) continue;
    if (Status s = write_file_atomically(folder.trajectory(kind), to_tum(trajectory_of(*frames, kind))); !s)
      return failure(s);
  }
  if (Status s = write_map(run_loop.global_map(), request, rig, folder, log); !s) return failure(s);
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

Result<RunOutcome> run_recording(const RunRequest& request, const RunHooks& given_hooks) {
  const auto start = std::chrono::steady_clock::now();
  OpenOptions open;
  open.format = request.format;
  open.rig_file = request.rig_file;
  auto source = open_recording(request.input, open);
  if (!source) return failure(source);
  const RecordingInfo& info = (*source)->info();

  const RunFolder folder{request.output};
  const std::string mask_folder = std::filesystem::path(info.rig_source).parent_path().string();
  RunOptions options = request.options;
  if (options.gravity_m_s2 == 0) options.gravity_m_s2 = info.gravity_m_s2.value_or(0);
  if (options.use_specified_noise) {
    options.localization =
        with_specified_noise(options.localization, info.noise, request.given.in_group("localization"));
  }
  auto pipeline = Pipeline::create(info.rig, options, ThreadPool(request.threads), mask_folder);
  if (!pipeline) return failure(pipeline);
  if (Status fits = pipeline->check_memory(request.memory_bytes); !fits) return failure(fits);
  auto prepared = prepare_run_folder(folder, request.resume);
  if (!prepared) return failure(prepared);
  RunHooks hooks = given_hooks;
  hooks.log = given_hooks.log.with_file(folder.log());
  report_sequence(info, hooks.log);
  if (options.odometry_only) hooks.log.info("odometry only: no localization, no maps, no SLAM, no terrain");
  const auto listing = (*source)->listing_hash();
  if (!listing) return failure(listing);
  const RunIdentity identity{fmt::format("{:016x}", *listing), dump_options(options), to_rig_yaml(info.rig)};
  auto store = open_store(request, folder, identity);
  if (!store) return failure(store);
  if (Status s = write_file_atomically(folder.config(), identity.options); !s) return failure(s);
  if (Status s = write_file_atomically(folder.rig(), identity.rig); !s) return failure(s);

  RunLoop run_loop(request, hooks, **source, std::move(*pipeline), std::move(*store), folder);
  if (Status s = run_loop.begin(); !s) return failure(s);
  if (Status s = run_loop.process_samples(); !s) return failure(s);
  report_sensor_rows(**source, hooks.log);
  if (run_loop.usable_frames() == 0 && !run_loop.stopped()) {
    // An empty run folder would block the next attempt.
    if (prepared->state == FolderState::created) remove_run_folder(folder);
    return failure(ErrorCode::input, "the recording has no usable frame; first error: " + run_loop.first_error(),
                   info.path);
  }

  RunFacts facts;
  facts.version = request.version;
  facts.input = info.path;
  facts.format = name_of(info.format);
  facts.gravity_measured = run_loop.gravity_measured();
  facts.heading_east = run_loop.heading_east();
  facts.threads = request.threads;
  facts.absent = disabled_stages(options);
  facts.sensor_rows_reversed = (*source)->sensor_samples_discarded();
  facts.sensor_rows_unreadable = (*source)->unreadable_sensor_rows().count;
  facts.resumed_from_frame = run_loop.resumed_from_frame();
  facts.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  facts.cpu_seconds = cpu_seconds();
  auto outcome = write_results(run_loop, request, info.rig, folder, facts, hooks.log);
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
