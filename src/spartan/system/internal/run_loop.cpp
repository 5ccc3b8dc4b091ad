#include "spartan/system/internal/run_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "spartan/core/trajectory.h"
#include "spartan/system/internal/terrain_files.h"
#include "spartan/system/map_files.h"

namespace spartan::internal {
namespace {

// Length of the interval from the first IMU sample that initializes gravity if no sample comes before the first frame:
// a recording often starts its camera and its IMU together, while the rover is stationary. Empirical.
constexpr double kAlignmentSeconds = 1;
// Number of frames from one checkpoint to the next; the first frame has one, too. The state of the pipeline is large
// (some 1 MB at 1200 landmarks), and to process so many frames again after a crash takes little time.
constexpr int kFramesPerCheckpoint = 250;
// A live run looks so often whether it should stop.
constexpr std::chrono::milliseconds kStopPoll{50};

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

}  // namespace

Status RunLoop::begin() {
  pipeline_.store_maps_in(store_.tiles());
  total_frames_ = recording_ ? static_cast<int>(recording_->listed_stamps(pipeline_.odometry_pair()).size()) : 0;
  if (request_.max_frames > 0)
    total_frames_ = recording_ ? std::min(total_frames_, request_.max_frames) : request_.max_frames;
  auto checkpoint = store_.checkpoint();
  if (!checkpoint) return failure(checkpoint);
  if (!*checkpoint) {
    if (!recording_) return {};
    const auto imu = recording_->imu_samples({}, kAlignmentSeconds);
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
  const Trajectory so_far = trajectory_of(*frames, TrajectoryKind::odometry);
  distance_m_ = path_length(so_far);
  if (!so_far.empty()) last_position_ = so_far.back().pose.translation();
  for (const FrameRecord& frame : *frames) usable_frames_ += frame.status != "missing";
  if (Status status = pipeline_.restore((*checkpoint)->pipeline_state, store_.tiles()); !status) return status;
  for (const FrameKey& key : pipeline_.pending_frames()) {
    const auto frame = recording_->frame_at(key.pair, key.left_stamp);
    if (!frame) return failure(frame);
    if (Status status = pipeline_.restore_frame(*frame); !status) return status;
  }
  samples_taken_ = (*checkpoint)->source.samples_taken;
  elapsed_before_ = (*checkpoint)->elapsed;
  resumed_ = true;
  hooks_.log.info(fmt::format("resuming after frame {}", frames->back().frame_id));
  return seek(**checkpoint);
}

Status RunLoop::seek(const RunStore::Checkpoint& checkpoint) {
  if (Status sought = recording_->seek(checkpoint.source.samples_taken); !sought) return sought;
  if (recording_->content_hash() == checkpoint.source.content_hash) return {};
  return failure(ErrorCode::configuration,
                 "the recording is not the one that the run began with: an image or a row of a sensor table that was "
                 "processed has changed",
                 stream_.info().path, "restore the recording, or run into a new folder");
}

ElapsedTime RunLoop::elapsed() const {
  const std::chrono::duration<double> here = std::chrono::steady_clock::now() - start_;
  return {elapsed_before_.wall_s + here.count(), elapsed_before_.cpu_s + cpu_seconds() - start_cpu_s_};
}

Status RunLoop::process_samples() {
  if (Status status = process_until_end(); !status) return status;
  if (frames_since_checkpoint_ == 0) return {};
  return checkpoint({});
}

Status RunLoop::process_until_end() {
  while (request_.max_frames == 0 || frames_ < request_.max_frames) {
    if (hooks_.should_stop && hooks_.should_stop()) {
      stopped_ = true;
      return {};
    }
    const auto read = this->read();
    if (!read) return failure(read);
    if (read->state == StreamRead::State::end) return finish();
    if (read->state == StreamRead::State::none_yet) continue;
    ++samples_taken_;
    arrived_ = read->arrived;
    if (Status status = process(*read->sample); !status) return status;
  }
  return {};
}

// The time of waiting for a live sample is not that of a stage.
Result<StreamRead> RunLoop::read() {
  if (!recording_) return stream_.read(kStopPoll);
  return clock_.measure("camera", [&] { return stream_.read({}); });
}

// Commits what is complete only at the end of the stream: the maps of the last stops, the last terrain view and the
// stage times since the last frame.
Status RunLoop::finish() {
  clock_.take();  // discards the read attempt at the end of the recording
  complete_ = true;
  bool any = false;
  for (;;) {
    const auto stop = pipeline_.finish_stop();
    if (!stop) return failure(stop);
    const std::optional<TerrainView> terrain = pipeline_.finish_terrain();
    RunStore::Step step;
    if (Status written = write_files(terrain, *stop, step); !written) return written;
    step.times = take_stage_times();
    step.localization_inputs = pipeline_.take_localization_inputs();
    const bool last = !*stop && !terrain;
    any = any || !last || !step.times.empty();
    if (frames_ == 0 || !any) return {};
    if (last) return checkpoint(step);
    if (Status committed = store_.commit(step); !committed) return committed;
  }
}

Status RunLoop::write_files(const std::optional<TerrainView>& terrain, const std::optional<MappedStop>& stop,
                            RunStore::Step& step) {
  if (terrain) {
    auto written =
        clock_.measure("terrain", [&] { return write_terrain(*terrain, request_.options.terrain, folder_.terrain()); });
    if (!written) return failure(written);
    step.terrain = *written;
  }
  if (stop) {
    const auto map = write_map_of(*stop);
    if (!map) return failure(map);
    step.map = *map;
  }
  return {};
}

std::vector<StageTime> RunLoop::take_stage_times() {
  std::vector<StageTime> times = std::exchange(view_times_, {});
  for (const std::vector<StageTime>& measured : {clock_.take(), pipeline_.take_stage_times()})
    times.insert(times.end(), measured.begin(), measured.end());
  return times;
}

Result<MapRecord> RunLoop::write_map_of(const MappedStop& stop) {
  const LocalMap& map = stop.merged.local;
  const MapContext about{heading_east(), {{0, stop.stamp}}};
  const Status written =
      clock_.measure("maps", [&] { return write_local_map(map, about, folder_.local_map(stop.stamp)); });
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

Status RunLoop::process_frame(const StereoFrame& frame, std::string_view fault) {
  auto result = pipeline_.add(frame);
  if (!result) {
    // A frame that does not fit the rig or repeats an image is reported, counted and skipped. Any other error ends the
    // run.
    if (result.error().code != ErrorCode::frame_rejected) return failure(result);
    return process_missing(
        {frame.frame_id, frame.pair, frame.left_stamp, pipeline_.fault_of(frame), result.error().message(), {}});
  }
  if (!*result) {
    view_times_ = take_stage_times();
    return {};
  }
  FrameResult& output = **result;
  if (!recording_) latencies_.add(arrived_, std::chrono::steady_clock::now(), frame.position_id >= 0);
  ++usable_frames_;
  RunStore::Step step;
  FrameRecord& record = step.frame.emplace();
  record.frame_id = output.frame_id;
  record.pair = output.pair;
  record.stamp = output.stamp;
  record.status = name_of(output.motion.status);
  record.fault = fault;
  record.message = output.motion.reason;
  record.has_pose = output.motion.status != TrackingStatus::lost;
  record.world_from_body = output.world_from_body;
  record.motion = output.motion;
  record.slam = output.slam;
  if (output.localization) record.localization = localization_record(*output.localization);
  if (output.motion.status == TrackingStatus::lost) {
    hooks_.log.warning(fmt::format("frame {}: odometry lost: {}", output.frame_id, output.motion.reason));
  }
  if (Status written = write_files(output.terrain, output.stop, step); !written) return written;
  record.times = take_stage_times();
  record.times.insert(record.times.end(), output.times.begin(), output.times.end());
  return commit(step);
}

Status RunLoop::process_missing(const MissingFrame& missing) {
  // Landmarks need a pair.
  if (missing.partial && usable_frames_ > 0 && missing.pair == pipeline_.odometry_pair()) {
    hooks_.log.warning(fmt::format("frame {}: {}; the other image is used alone", missing.frame_id, missing.message));
    return process_frame(*missing.partial, name_of(missing.fault));
  }
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

Status RunLoop::commit(RunStore::Step step) {
  step.localization_inputs = pipeline_.take_localization_inputs();
  if (resumed_ && !resumed_from_frame_ && step.frame) resumed_from_frame_ = step.frame->frame_id;
  ++frames_since_checkpoint_;
  const bool due = frames_ == 0 || frames_since_checkpoint_ >= kFramesPerCheckpoint;
  Status status = due ? checkpoint(step) : store_.commit(step);
  ++frames_;
  if (step.frame->has_pose) {
    const Eigen::Vector3d& position = step.frame->world_from_body.pose.translation();
    if (last_position_) distance_m_ += (position - *last_position_).norm();
    last_position_ = position;
  }
  if (status && hooks_.progress) hooks_.progress({frames_, total_frames_, distance_m_, step.frame->status});
  return status;
}

Status RunLoop::checkpoint(const RunStore::Step& step) {
  const auto save = [&]() -> Result<Bytes> {
    if (Status flushed = pipeline_.flush_maps(); !flushed) return failure(flushed);
    return pipeline_.save();
  };
  Status status = store_.commit(step, save, {samples_taken_, recording_ ? recording_->content_hash() : 0}, elapsed());
  if (status) frames_since_checkpoint_ = 0;
  return status;
}

}  // namespace spartan::internal
