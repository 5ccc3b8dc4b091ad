#include "spartan/system/internal/run_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>
#include <vector>

#include "spartan/core/trajectory.h"
#include "spartan/system/run_folder.h"

namespace spartan::internal {
namespace {

// Length of the interval from the first IMU sample that initializes gravity if no sample comes before the first frame:
// a recording often starts its camera and its IMU together, while the rover is stationary. Empirical.
constexpr double kAlignmentSeconds = 1;
// The back end has the lowest priority: beside other programs that use all cores it gets some percent of one.
constexpr double kBackEndPatience = 10;
// A live run looks so often whether it should stop.
constexpr std::chrono::milliseconds kStopPoll{50};

}  // namespace

Status RunLoop::begin() {
  pipeline_.store_maps_in(recorder_->tiles());
  recorder_->report_maps_to(hooks_.map);
  total_frames_ = recording_ ? static_cast<int>(recording_->listed_stamps(pipeline_.odometry_pair()).size()) : 0;
  if (request_.max_frames > 0)
    total_frames_ = recording_ ? std::min(total_frames_, request_.max_frames) : request_.max_frames;
  auto checkpoint = recorder_->store().checkpoint();
  if (!checkpoint) return failure(checkpoint);
  if (!*checkpoint) {
    if (!recording_) return {};
    const auto imu = recording_->imu_samples({}, kAlignmentSeconds);
    if (!imu) return failure(imu);
    pipeline_.align_with_gravity(*imu);
    return {};
  }
  const auto frames = recorder_->store().frames();
  if (!frames) return failure(frames);
  if (frames->empty()) {
    return failure(ErrorCode::store_damaged, "is damaged: it has a saved state, but table 'frames' is empty",
                   RunFolder{request_.output}.store(), "run again into a new folder");
  }
  frames_ = static_cast<int>(frames->size());
  const Trajectory so_far = trajectory_of(*frames, TrajectoryKind::odometry);
  distance_m_ = path_length(so_far);
  if (!so_far.empty()) last_position_ = so_far.back().pose.translation();
  for (const FrameRecord& frame : *frames) {
    usable_frames_ += frame.status != "missing";
    if (!frame.localization) continue;
    for (const LocalizationRecord::Sensor& sensor : frame.localization->sensors) {
      if (sensor.test) tested_[sensor.name] = sensor.test->stamp;
    }
  }
  if (Status status = pipeline_.restore((*checkpoint)->pipeline_state, recorder_->tiles()); !status) return status;
  if (Status status = restore_pending_frames(); !status) return status;
  samples_taken_ = (*checkpoint)->source.samples_taken;
  elapsed_before_ = (*checkpoint)->elapsed;
  resumed_ = true;
  hooks_.log.info(fmt::format("resuming after frame {}", frames->back().frame_id));
  return seek(**checkpoint, frames->back().frame_id);
}

// Of a live run the frames may not have been recorded: with a disk that was full, or without a recording.
Status RunLoop::restore_pending_frames() {
  std::vector<StereoFrame> frames;
  for (const FrameKey& key : pipeline_.pending_frames()) {
    auto frame = frame_at(key);
    if (!frame && !recording_ && frame.error().code == ErrorCode::input) {
      hooks_.log.warning(fmt::format("what was to be made of the last views of the interrupted run is lost: {}",
                                     frame.error().message()));
      pipeline_.abandon_pending_frames();
      return {};
    }
    if (!frame) return failure(frame);
    frames.push_back(std::move(*frame));
  }
  for (const StereoFrame& frame : frames) {
    if (Status status = pipeline_.restore_frame(frame); !status) return status;
  }
  return {};
}

Result<StereoFrame> RunLoop::frame_at(const FrameKey& key) {
  return recording_ ? recording_->frame_at(key.pair, key.left_stamp)
                    : resumed_stream_->frame_at(key.pair, key.left_stamp);
}

Status RunLoop::seek(const RunStore::Checkpoint& checkpoint, std::int64_t last_id) {
  if (!recording_) {
    last_stamps_ = checkpoint.source.last_stamps;
    resumed_stream_->skip_until(last_stamps_, last_id);
    return {};
  }
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
  std::optional<Watchdog> watchdog;
  if (request_.watchdog_s > 0 && hooks_.hung) {
    pipeline_.show_stages_in(front_end_);
    const double limit_s = request_.watchdog_s;
    watchdog.emplace(std::vector<WatchedStage>{{&front_end_, limit_s},
                                               {&pipeline_.back_end_stage(), kBackEndPatience * limit_s},
                                               {&recorder_->running(), kBackEndPatience * limit_s},
                                               {&recorder_->waiting_for(), kBackEndPatience * limit_s}},
                     hooks_.hung);
  }
  const Status processed = process_until_end();
  if (processed && !complete_ && frames_ > 0) {
    RunResult last;
    last.step.times = take_stage_times();
    last.step.localization_inputs = pipeline_.take_localization_inputs();
    add_checkpoint(last);
    if (Status added = recorder_->add(std::move(last)); !added) return added;
  }
  if (stopped_) pipeline_.stop_back_end();
  // What was computed before an error is kept.
  const Status flushed = recorder_->flush();
  return processed ? flushed : processed;
}

Status RunLoop::process_until_end() {
  while (request_.max_frames == 0 || frames_ < request_.max_frames) {
    // What a recorded run has computed since its last frame is stored with the next one, resumed or not.
    const bool can_stop = !recording_ || after_frame_;
    meter_unused_frames();
    const bool wants_stop = (hooks_.should_stop && hooks_.should_stop()) || execute_commands();
    if (wants_stop && can_stop) {
      stopped_ = std::chrono::steady_clock::now();
      return {};
    }
    const auto read = this->read();
    if (!read) return failure(read);
    if (read->state == StreamRead::State::end) return finish();
    if (read->state == StreamRead::State::none_yet) continue;
    ++samples_taken_;
    arrived_ = read->arrived;
    if (!recording_) last_stamps_[source_of(*read->sample)] = stamp_of(*read->sample);
    after_frame_ = false;
    front_end_.begin("front end");
    Status status = process(*read->sample);
    front_end_.end(nullptr);
    if (!status) return status;
  }
  return {};
}

// The time of waiting for a live sample is not that of a stage.
Result<StreamRead> RunLoop::read() {
  catching_up_ = resumed_stream_ && resumed_stream_->is_catching_up();
  if (resumed_stream_) pipeline_.set_pace(catching_up_ ? Pace::recorded : Pace::live);
  if (!recording_) return stream_.read(kStopPoll);
  return clock_.measure("camera", [&] { return stream_.read({}); });
}

// Commits what is complete only at the end of the stream: the maps of the last stops, the last terrain view and the
// stage times since the last frame.
Status RunLoop::finish() {
  clock_.take();  // discards the read attempt at the end of the stream
  complete_ = true;
  for (;;) {
    auto stop = pipeline_.finish_stop();
    if (!stop) return failure(stop);
    RunResult result;
    result.stop = std::move(*stop);
    result.terrain = pipeline_.finish_terrain();
    result.x_is_east = heading_east();
    const bool last = !result.stop && !result.terrain;
    result.step.times = take_stage_times();
    result.step.localization_inputs = pipeline_.take_localization_inputs();
    if (frames_ == 0) return {};
    if (last) add_checkpoint(result);
    if (Status added = recorder_->add(std::move(result)); !added) return added;
    if (last) return {};
  }
}

std::vector<StageTime> RunLoop::take_stage_times() {
  std::vector<StageTime> times = std::exchange(view_times_, {});
  for (const std::vector<StageTime>& measured : {clock_.take(), pipeline_.take_stage_times()})
    times.insert(times.end(), measured.begin(), measured.end());
  return times;
}

bool RunLoop::execute_commands() {
  if (recording_ || !hooks_.command) return false;
  while (const auto command = hooks_.command()) {
    if (*command == RunCommand::stop) return true;
    if (panorama_) {
      panorama_->request();
    } else {
      hooks_.log.warning("no panorama: the run has no pan-tilt unit");
    }
  }
  return false;
}

// Frames of the pan-tilt unit's cameras that are no views show how bright it is there.
void RunLoop::meter_unused_frames() {
  if (exposure_ == nullptr || panorama_ == nullptr || catching_up_) return;
  panorama_->meter([this](const StereoFrame& frame) {
    exposure_->update(frame, pipeline_.up_in_body(), pipeline_.body_velocity());
  });
}

Status RunLoop::process(const Sample& sample) {
  if (const auto* frame = std::get_if<StereoFrame>(&sample)) return process_frame(*frame);
  if (const auto* missing = std::get_if<MissingFrame>(&sample)) return process_missing(*missing);
  clock_.take();  // the summary does not list the time of reading sensor samples
  if (const auto* imu = std::get_if<ImuSample>(&sample)) {
    pipeline_.add(*imu);
    report_estimate();
    if (panorama_ && !catching_up_) panorama_->add(*imu);
  }
  if (const auto* wheels = std::get_if<WheelSample>(&sample)) {
    pipeline_.add(*wheels);
    if (panorama_ && !catching_up_) panorama_->add(*wheels);
  }
  if (const auto* compass = std::get_if<CompassSample>(&sample)) pipeline_.add(*compass);
  if (const auto* inclinometer = std::get_if<InclinometerSample>(&sample)) pipeline_.add(*inclinometer);
  return {};
}

Status RunLoop::process_frame(const StereoFrame& frame, std::string_view fault) {
  if (exposure_ && !catching_up_) exposure_->update(frame, pipeline_.up_in_body(), pipeline_.body_velocity());
  const bool at_stop = pipeline_.maps_a_stop();
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
  std::optional<double> latency_ms;
  if (!recording_ && !catching_up_) latency_ms = latencies_.add(arrived_, std::chrono::steady_clock::now(), at_stop);
  ++usable_frames_;
  RunResult recorded;
  FrameRecord& record = recorded.step.frame.emplace();
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
  record.latency_ms = latency_ms;
  if (output.localization) record.localization = localization_record(*output.localization);
  if (output.motion.status == TrackingStatus::lost) {
    hooks_.log.warning(fmt::format("frame {}: odometry lost: {}", output.frame_id, output.motion.reason));
  }
  if (!recording_ && output.stop && output.stop->position_id >= 0)
    latencies_.maps_ms.push_back(static_cast<float>(1e3 * output.stop->seconds));
  recorded.terrain = std::move(output.terrain);
  recorded.stop = std::move(output.stop);
  record.times = take_stage_times();
  record.times.insert(record.times.end(), output.times.begin(), output.times.end());
  return this->record(std::move(recorded));
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
  RunResult recorded;
  FrameRecord& record = recorded.step.frame.emplace();
  record.frame_id = missing.frame_id;
  record.pair = missing.pair;
  record.stamp = missing.stamp;
  record.status = "missing";
  record.fault = name_of(missing.fault);
  record.message = missing.message;
  record.world_from_body.pose = pipeline_.predict(missing.stamp).value_or(Pose());
  record.times = take_stage_times();
  return this->record(std::move(recorded));
}

Status RunLoop::record(RunResult result) {
  result.step.localization_inputs = pipeline_.take_localization_inputs();
  result.x_is_east = heading_east();
  const FrameRecord& frame = *result.step.frame;
  if (hooks_.frame) hooks_.frame(frame);
  report_estimate();
  if (resumed_ && !resumed_from_frame_) resumed_from_frame_ = frame.frame_id;
  ++frames_;
  after_frame_ = true;
  if (frame.has_pose) {
    const Eigen::Vector3d& position = frame.world_from_body.pose.translation();
    if (last_position_) distance_m_ += (position - *last_position_).norm();
    last_position_ = position;
  }
  if (panorama_ && !catching_up_) panorama_->add(RoverMotion{frame.stamp, distance_m_, pipeline_.body_velocity()});
  const RunProgress progress{frames_, total_frames_, distance_m_, frame.status};
  const CommitOptions& options = request_.options.commit;
  const bool far = options.every_m > 0 && distance_m_ - distance_committed_m_ >= options.every_m;
  result.commit_now = far || (options.at_maps && result.stop);
  if (far) distance_committed_m_ = distance_m_;
  const std::chrono::duration<double> since = std::chrono::steady_clock::now() - last_checkpoint_;
  const double state_every_s =
      can_be_read_again() ? options.state_every_s : std::min(options.state_every_s, options.every_s);
  const bool due = since.count() >= state_every_s && (recording_ || !recorder_->checkpoint_waits());
  if (frames_ == 1 || due) add_checkpoint(result);
  Status status = recorder_->add(std::move(result));
  pipeline_.map_changes_stored(recorder_->maps_stored());
  report_disk();
  report_recording();
  if (status && hooks_.progress) hooks_.progress(progress);
  return status;
}

// Each test of an innovation is in one record: none where a sensor was not tested since the frame before.
LocalizationRecord RunLoop::localization_record(const LocalizationEstimate& estimate) {
  LocalizationRecord record;
  record.world_from_body = estimate.world_from_body;
  record.odom_from_body = estimate.odom_from_body;
  if (estimate.slip) {
    record.slip = estimate.slip->slip;
    record.slip_sigma = estimate.slip->sigma;
  }
  for (std::size_t i = 0; i < estimate.health.size(); ++i) {
    const SensorHealth& health = estimate.health[i];
    LocalizationRecord::Sensor& sensor = record.sensors.emplace_back();
    sensor.name = name_of(static_cast<LocalizationSensor>(i));
    sensor.state = name_of(health.state);
    sensor.reason = health.reason;
    if (!health.test) continue;
    const auto recorded = tested_.find(sensor.name);
    if (recorded != tested_.end() && recorded->second == health.test->stamp) continue;
    tested_[sensor.name] = health.test->stamp;
    sensor.test = health.test;
  }
  return record;
}

void RunLoop::report_disk() {
  const auto error = recorder_->disk_error();
  if (error.has_value() == disk_failed_) return;
  disk_failed_ = error.has_value();
  if (error) {
    hooks_.log.error("results wait in memory, their commit is tried again: " + error->message());
  } else {
    hooks_.log.warning("the disk can be written to again: all results are committed");
  }
}

// Whether a resumed run could process the frames since the last state again.
bool RunLoop::can_be_read_again() const {
  if (recording_ || repeatable_) return true;
  return stream_recorder_ != nullptr && unrecorded_ == unrecorded_at_checkpoint_ && !recording_failed_;
}

void RunLoop::report_recording() {
  if (stream_recorder_ == nullptr) return;
  const RecorderProgress progress = stream_recorder_->progress();
  if (!progress.status && !recording_failed_)
    hooks_.log.error("the recording stops, the run goes on: " + progress.status.error().message());
  if (progress.dropped > 0 && unrecorded_ == 0) hooks_.log.warning("frames are not recorded: the disk is too slow");
  recording_failed_ = !progress.status;
  unrecorded_ = progress.dropped + progress.rejected;
}

void RunLoop::report_estimate() {
  if (!hooks_.estimate) return;
  if (const auto estimate = pipeline_.estimate()) hooks_.estimate(*estimate);
}

void RunLoop::add_checkpoint(RunResult& result) {
  last_checkpoint_ = std::chrono::steady_clock::now();
  unrecorded_at_checkpoint_ = unrecorded_;
  const std::uint64_t content = recording_ ? recording_->content_hash() : 0;
  result.checkpoint = RunStore::Checkpoint{pipeline_.save(), {samples_taken_, content, last_stamps_}, elapsed()};
  // The frames that the back end works on are read again from the recording.
  if (stream_recorder_) {
    result.can_commit_checkpoint = [recorder = stream_recorder_, count = stream_recorder_->added()] {
      return recorder->is_synced(count);
    };
  }
  result.maps = pipeline_.take_map_changes();
}

}  // namespace spartan::internal
