#include "spartan/system/run.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <utility>
#include <vector>

#include "spartan/core/files.h"
#include "spartan/core/process.h"
#include "spartan/core/trajectory.h"
#include "spartan/calibration_io/calibration_reading.h"
#include "spartan/system/map_files.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"
#include "spartan/system/internal/summary.h"
#include "spartan/system/internal/terrain_files.h"

namespace spartan {
namespace {

constexpr double kSecondsAtRest = 1;

// FNV-1a over what identifies a recording without reading its images: layout, pairs and announced stamps.
std::string fingerprint(const FrameSource& source) {
  std::uint64_t hash = 14695981039346656037ULL;
  const auto mix = [&hash](std::string_view bytes) {
    for (const char c : bytes) hash = (hash ^ static_cast<std::uint8_t>(c)) * 1099511628211ULL;
  };
  mix(name_of(source.info().format));
  for (const StereoPair& pair : source.info().rig.pairs) {
    mix(pair.name);
    for (const Stamp stamp : source.listed_stamps(pair.name)) mix(std::to_string(stamp.ns));
  }
  return fmt::format("{:016x}", hash);
}

void report_sequence(const RecordingInfo& info, const Log& log) {
  const SequenceReport& s = info.sequence;
  log.info(fmt::format("{}: {} recording ({}), rig from {}, {} stereo shots", info.path, name_of(info.format),
                       info.layout_reason, info.rig_source, s.announced));
  if (s.orphans_left + s.orphans_right > 0) {
    log.warning(
        fmt::format("{} left and {} right images have no partner near in time", s.orphans_left, s.orphans_right));
  }
  if (s.reversals > 0) log.warning(fmt::format("{} time stamps run backwards; those shots are skipped", s.reversals));
  if (s.gaps > 0) {
    log.warning(
        fmt::format("{} gaps, the longest {:.2f} s (usual step {:.3f} s)", s.gaps, s.longest_gap_s, s.median_step_s));
  }
}

LocalizationRecord record_of(const LocalizationEstimate& estimate) {
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

// One run from its first sample to its last.
class Drive {
 public:
  Drive(const RunRequest& request, const RunHooks& hooks, FrameSource& source, Pipeline pipeline, RunStore store,
        RunFolder folder)
      : request_(request),
        hooks_(hooks),
        source_(source),
        pipeline_(std::move(pipeline)),
        store_(std::move(store)),
        folder_(std::move(folder)) {}

  Status begin();
  Status drive();
  int usable() const { return usable_; }
  /// What is wrong with the first shot that was left out.
  const std::string& first_fault() const { return first_fault_; }
  bool stopped() const { return stopped_; }
  bool gravity_measured() const { return pipeline_.gravity_measured(); }
  bool heading_east() const { return pipeline_.heading_east(); }
  std::optional<std::int64_t> resumed_from_frame() const { return resumed_from_frame_; }
  RunStore& store() { return store_; }
  GlobalMap& global_map() { return pipeline_.global_map(); }

 private:
  Status take(const Sample& sample);
  Status finish();
  Result<MapRecord> keep(const MappedPosition& position);
  Status take_frame(const StereoFrame& frame);
  Status take_missing(const MissingFrame& missing);
  Status commit(const RunStore::Step& step);
  std::vector<StageTime> take_times();

  const RunRequest& request_;
  const RunHooks& hooks_;
  FrameSource& source_;
  Pipeline pipeline_;
  RunStore store_;
  RunFolder folder_;
  StageClock clock_;
  std::vector<StageTime> looked_;  // of shots that were only looked at since the last frame
  std::int64_t samples_taken_ = 0;
  int shots_ = 0;   // announced shots taken, missing ones too
  int usable_ = 0;  // shots with both images
  std::string first_fault_;
  bool stopped_ = false;
  bool resumed_ = false;
  std::optional<std::int64_t> resumed_from_frame_;
};

Status Drive::begin() {
  pipeline_.page_maps_to(store_.tiles());
  auto memory = store_.memory();
  if (!memory) return failure(memory);
  if (!*memory) {
    // Recordings often begin with camera and IMU together, and a rover that rests.
    const auto imu = source_.imu_samples({}, kSecondsAtRest);
    if (!imu) return failure(imu);
    pipeline_.level(*imu);
    return {};
  }
  const auto frames = store_.frames();
  if (!frames) return failure(frames);
  shots_ = static_cast<int>(frames->size());
  for (const FrameRecord& frame : *frames) usable_ += frame.status != "missing";
  if (Status status = pipeline_.restore((*memory)->stages, store_.tiles()); !status) return status;
  for (const FrameKey& wanted : pipeline_.wanted_shots()) {
    const auto shot = source_.frame_at(wanted.pair, wanted.left_stamp);
    if (!shot) return failure(shot);
    if (Status status = pipeline_.recall(*shot); !status) return status;
  }
  samples_taken_ = (*memory)->samples_taken;
  resumed_ = true;
  hooks_.log.info(fmt::format("resuming behind frame {}", frames->back().frame_id));
  return source_.seek(samples_taken_);
}

Status Drive::drive() {
  while (request_.max_frames == 0 || shots_ < request_.max_frames) {
    if (hooks_.should_stop && hooks_.should_stop()) {
      stopped_ = true;
      return {};
    }
    const auto sample = clock_.measure("camera", [&] { return source_.next(); });
    if (!sample) return failure(sample);
    if (!*sample) return finish();
    ++samples_taken_;
    if (Status status = take(**sample); !status) return status;
  }
  return {};
}

// What is known at the end only: the map of the last position, and what took its time since the last frame.
Status Drive::finish() {
  clock_.take();  // there was no further shot
  auto position = pipeline_.leave_position();
  if (!position) return failure(position);
  RunStore::Step step;
  if (*position) {
    const auto map = keep(**position);
    if (!map) return failure(map);
    step.map = *map;
  }
  step.times = take_times();
  if (shots_ == 0 || (!step.map && step.times.empty())) return {};
  return commit(step);
}

std::vector<StageTime> Drive::take_times() {
  std::vector<StageTime> times = std::exchange(looked_, {});
  for (const std::vector<StageTime>& measured : {clock_.take(), pipeline_.take_times()})
    times.insert(times.end(), measured.begin(), measured.end());
  return times;
}

Result<MapRecord> Drive::keep(const MappedPosition& position) {
  const LocalMap& map = position.merged.local;
  const Status written =
      clock_.measure("maps", [&] { return write_local_map(map, folder_.local_map(position.stamp)); });
  if (!written) return failure(written);
  MapRecord record;
  record.stamp = position.stamp;
  record.position_id = position.position_id;
  record.views = position.views;
  record.believed = position.believed;
  record.world_from_body = position.merged.corrected;
  record.verdict = name_of(position.merged.match.status);
  record.overlap = position.merged.match.overlap;
  record.obstacles = static_cast<int>(map.obstacles.size());
  for (int y = 0; y < map.size().height; ++y) {
    for (int x = 0; x < map.size().width; ++x) record.known_cells += map.count(x, y) > 0 ? 1 : 0;
  }
  return record;
}

Status Drive::take(const Sample& sample) {
  if (const auto* frame = std::get_if<StereoFrame>(&sample)) return take_frame(*frame);
  if (const auto* missing = std::get_if<MissingFrame>(&sample)) return take_missing(*missing);
  clock_.take();  // reading a number from a table is not worth a line in the summary
  if (const auto* imu = std::get_if<ImuSample>(&sample)) pipeline_.add(*imu);
  if (const auto* wheels = std::get_if<WheelSample>(&sample)) pipeline_.add(*wheels);
  if (const auto* compass = std::get_if<CompassSample>(&sample)) pipeline_.add(*compass);
  if (const auto* inclinometer = std::get_if<InclinometerSample>(&sample)) pipeline_.add(*inclinometer);
  return {};
}

Status Drive::take_frame(const StereoFrame& frame) {
  auto result = pipeline_.add(frame);
  if (!result) {
    // The frame does not fit the rig: it is said, counted and left out. Whatever else fails ends the run.
    if (result.error().code != ErrorCode::frame_rejected) return failure(result);
    return take_missing(
        {frame.frame_id, frame.pair, frame.left_stamp, FrameFault::wrong_size, result.error().message()});
  }
  if (!*result) {
    looked_ = take_times();
    return {};
  }
  FrameResult& shot = **result;
  ++usable_;
  RunStore::Step step;
  FrameRecord& record = step.frame.emplace();
  record.frame_id = shot.frame_id;
  record.pair = shot.pair;
  record.stamp = shot.stamp;
  record.status = name_of(shot.motion.status);
  record.message = shot.motion.reason;
  record.has_pose = shot.motion.status != TrackingStatus::lost;
  record.world_from_body = shot.world_from_body;
  record.motion = shot.motion;
  record.slam = shot.slam;
  if (shot.localization) record.localization = record_of(*shot.localization);
  if (shot.motion.status == TrackingStatus::lost) {
    hooks_.log.warning(fmt::format("frame {}: lost: {}", shot.frame_id, shot.motion.reason));
  }
  if (shot.terrain) {
    auto written = clock_.measure(
        "terrain", [&] { return write_terrain(*shot.terrain, request_.options.terrain, folder_.terrain()); });
    if (!written) return failure(written);
    step.terrain = *written;
  }
  if (shot.position) {
    const auto map = keep(*shot.position);
    if (!map) return failure(map);
    step.map = *map;
  }
  record.times = take_times();
  record.times.insert(record.times.end(), shot.times.begin(), shot.times.end());
  return commit(step);
}

Status Drive::take_missing(const MissingFrame& missing) {
  hooks_.log.warning(
      fmt::format("frame {} skipped ({}): {}", missing.frame_id, name_of(missing.fault), missing.message));
  clock_.take();
  if (first_fault_.empty()) first_fault_ = missing.message;
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
  record.times = take_times();
  return commit(step);
}

Status Drive::commit(const RunStore::Step& step) {
  if (resumed_ && !resumed_from_frame_ && step.frame) resumed_from_frame_ = step.frame->frame_id;
  const auto save = [&]() -> Result<Bytes> {
    if (Status flushed = pipeline_.flush_maps(); !flushed) return failure(flushed);
    return pipeline_.save();
  };
  Status status = store_.commit(step, save, samples_taken_);
  if (!step.frame) return status;
  ++shots_;
  if (status && hooks_.progress) hooks_.progress({shots_, source_.info().sequence.announced, step.frame->status});
  return status;
}

Result<RunStore> open_store(const RunRequest& request, const RunFolder& folder, const RunIdentity& identity) {
  if (request.resume) {
    const auto begun = RunStore::holds_a_run(folder.store());
    if (!begun) return failure(begun);
    if (*begun) return RunStore::resume(folder.store(), identity);
  }
  return RunStore::create(folder.store(), identity);
}

Status write_map(GlobalMap& map, const RunRequest& request, const RunFolder& folder, const Log& log) {
  if (map.extent().cells() > GlobalMap::kMostCells) {
    log.warning("the global map is too large for one picture; `spartan map export --window` takes a part of it");
    return remove_map_files(folder.global_map());  // of an earlier part of the run
  }
  return write_global_map(map, request.options.mapping.map, ThreadPool(request.threads), folder.global_map());
}

// What the options leave out of a run.
std::vector<std::string> absent_parts(const RunOptions& options) {
  std::vector<std::string> absent;
  if (options.odometry_only) absent = {"localization", "slam"};
  if (options.odometry_only || !options.maps) absent.emplace_back("maps");
  if (options.odometry_only || !options.terrain.enabled) absent.emplace_back("terrain");
  return absent;
}

// Text files are made from the store alone, so a resumed run writes the same bytes.
Result<RunOutcome> write_results(Drive& drive, const RunRequest& request, const RunFolder& folder, RunFacts facts,
                                 const Log& log) {
  const auto frames = drive.store().frames();
  if (!frames) return failure(frames);
  for (const TrajectoryKind kind : kTrajectoriesBestFirst) {
    if (request.options.odometry_only && kind != TrajectoryKind::odometry) continue;
    if (Status s = write_file_atomically(folder.trajectory(kind), to_tum(trajectory_of(*frames, kind))); !s)
      return failure(s);
  }
  if (Status s = write_map(drive.global_map(), request, folder, log); !s) return failure(s);
  facts.peak_memory_bytes = peak_memory_bytes();
  RunOutcome outcome;
  outcome.summary_json = to_summary_json(facts, *frames);
  outcome.lost = !lost_spans(*frames).empty();
  outcome.interrupted = drive.stopped();
  if (Status s = write_file_atomically(folder.summary(), outcome.summary_json); !s) return failure(s);
  return outcome;
}

}  // namespace

Result<RunOutcome> run(const RunRequest& request, const RunHooks& given_hooks) {
  const auto began = std::chrono::steady_clock::now();
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
  if (options.noise_as_stated)
    options.localization =
        with_specified_noise(options.localization, info.noise, request.given.in_group("localization"));
  auto pipeline = Pipeline::create(info.rig, options, ThreadPool(request.threads), mask_folder);
  if (!pipeline) return failure(pipeline);
  const auto prepared = prepare_run_folder(folder, request.resume);
  if (!prepared) return failure(prepared);
  RunHooks hooks = given_hooks;
  hooks.log = given_hooks.log.with_file(folder.log());
  report_sequence(info, hooks.log);
  if (options.odometry_only) hooks.log.info("odometry only: no localization, no maps, no SLAM, no terrain");
  const RunIdentity identity{fingerprint(**source), dump_options(options), to_rig_yaml(info.rig)};
  auto store = open_store(request, folder, identity);
  if (!store) return failure(store);
  if (Status s = write_file_atomically(folder.config(), identity.options); !s) return failure(s);
  if (Status s = write_file_atomically(folder.rig(), identity.rig); !s) return failure(s);

  Drive drive(request, hooks, **source, std::move(*pipeline), std::move(*store), folder);
  if (Status s = drive.begin(); !s) return failure(s);
  if (Status s = drive.drive(); !s) return failure(s);
  if (const std::int64_t rows = (*source)->sensor_samples_discarded(); rows > 0)
    hooks.log.warning(fmt::format("{} sensor samples left out: their stamps run against those around them", rows));
  if (drive.usable() == 0 && !drive.stopped()) {
    // There is nothing in it, and it would be in the way of the next try.
    if (*prepared == FolderState::made) remove_run_folder(folder);
    return failure(ErrorCode::input, "the recording has no usable frame; the first one: " + drive.first_fault(),
                   info.path);
  }

  RunFacts facts;
  facts.version = request.version;
  facts.input = info.path;
  facts.format = name_of(info.format);
  facts.gravity_measured = drive.gravity_measured();
  facts.heading_east = drive.heading_east();
  facts.threads = request.threads;
  facts.absent = absent_parts(options);
  facts.resumed_from_frame = drive.resumed_from_frame();
  facts.wall_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  facts.cpu_seconds = cpu_seconds();
  return write_results(drive, request, folder, facts, hooks.log);
}

}  // namespace spartan
