// The loop of a run over the samples of its stream.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/core/result.h"
#include "spartan/core/stage_clock.h"
#include "spartan/system/internal/exposure_stage.h"
#include "spartan/system/internal/latency_record.h"
#include "spartan/system/internal/panorama.h"
#include "spartan/system/internal/resumed_stream.h"
#include "spartan/system/internal/run_recorder.h"
#include "spartan/system/internal/watchdog.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

/// Where the samples of a run come from. Borrowed; the last three may be null.
struct RunStream {
  SampleStream& samples;
  Recording* recording;      ///< the samples, if they are recorded; null: live
  ResumedStream* resumed;    ///< the samples, if the run is live and is resumed
  StreamRecorder* recorder;  ///< that records a live stream
  ExposureStage* exposure;   ///< null: the cameras are not controlled
  Panorama* panorama;        ///< null: there are none
};

/// Feeds the samples of a stream to the pipeline and its results to the recorder, and now and then the state of the
/// pipeline.
class RunLoop {
 public:
  /// `start`, `start_cpu_s`: when this execution of the run began (core/stage_clock.h).
  RunLoop(const RunRequest& request, const RunHooks& hooks, const RunStream& stream, Pipeline pipeline,
          std::unique_ptr<RunRecorder> recorder, std::chrono::steady_clock::time_point start, double start_cpu_s)
      : request_(request),
        hooks_(hooks),
        stream_(stream.samples),
        recording_(stream.recording),
        resumed_stream_(stream.resumed),
        stream_recorder_(stream.recorder),
        repeatable_(stream.samples.is_repeatable()),
        exposure_(stream.exposure),
        panorama_(stream.panorama),
        recorder_(std::move(recorder)),
        pipeline_(std::move(pipeline)),
        start_(start),
        start_cpu_s_(start_cpu_s) {}

  /// Restores the state of the run to be resumed, or initializes a new one.
  Status begin();
  /// Processes samples until the end, the frame limit or a request to stop.
  Status process_samples();
  int usable_frames() const { return usable_frames_; }
  /// Error message of the first frame that was skipped.
  const std::string& first_error() const { return first_error_; }
  bool stopped() const { return stopped_.has_value(); }
  /// When the loop saw the request to stop. Only where stopped().
  std::chrono::steady_clock::time_point stop_time() const { return *stopped_; }
  /// Whether the whole recording was processed.
  bool complete() const { return complete_; }
  bool gravity_measured() const { return pipeline_.gravity_measured(); }
  bool heading_east() const { return pipeline_.heading_east(); }
  std::optional<std::int64_t> resumed_from_frame() const { return resumed_from_frame_; }
  /// Since the run began, without what an interrupted execution did after its last commit.
  ElapsedTime elapsed() const;
  /// Of a live run.
  const LatencyRecord& latencies() const { return latencies_; }
  RunStore& store() { return recorder_->store(); }
  RecorderStatistics recorder_statistics() const { return recorder_->statistics(); }
  GlobalMap& global_map() { return pipeline_.global_map(); }

 private:
  Status process_until_end();
  Result<StreamRead> read();
  Status seek(const RunStore::Checkpoint& checkpoint, std::int64_t last_id);
  Status restore_pending_frames();
  Result<StereoFrame> frame_at(const FrameKey& key);
  Status process(const Sample& sample);
  /// Whether the run is to end.
  bool execute_commands();
  void meter_unused_frames();
  Status finish();
  /// `fault`: of the image that is missing; empty where both are there.
  Status process_frame(const StereoFrame& frame, std::string_view fault = {});
  /// Of a frame with one image, the motion is measured in it.
  Status process_missing(const MissingFrame& missing);
  /// Records a frame, with a checkpoint where one is due.
  Status record(RunResult result);
  LocalizationRecord localization_record(const LocalizationEstimate& estimate);
  void add_checkpoint(RunResult& result);
  void report_estimate();
  void report_disk();
  void report_recording();
  bool can_be_read_again() const;
  std::vector<StageTime> take_stage_times();

  const RunRequest& request_;
  const RunHooks& hooks_;
  SampleStream& stream_;
  Recording* recording_;  // null: live
  ResumedStream* resumed_stream_;
  StreamRecorder* stream_recorder_;
  bool repeatable_;  // SampleStream::is_repeatable()
  ExposureStage* exposure_;
  Panorama* panorama_;
  std::map<std::string, Stamp> last_stamps_;  // of a live stream, by source_of()
  std::unique_ptr<RunRecorder> recorder_;
  Pipeline pipeline_;  // reads map tiles through the recorder
  RunningStage front_end_;
  std::chrono::steady_clock::time_point start_;
  double start_cpu_s_;
  ElapsedTime elapsed_before_;  // this execution
  StageClock clock_;
  std::vector<StageTime> view_times_;  // of views of a stop since the last frame of the odometry pair
  std::int64_t samples_taken_ = 0;     // number of samples read from the stream
  int frames_ = 0;                     // frames of the odometry pair, missing ones included
  int total_frames_ = 0;               // listed frames of the odometry pair, at most max_frames
  double distance_m_ = 0;              // path length of the odometry
  std::optional<Eigen::Vector3d> last_position_;
  std::chrono::steady_clock::time_point last_checkpoint_;
  double distance_committed_m_ = 0;
  int usable_frames_ = 0;  // frames of the odometry pair that were processed
  std::string first_error_;
  std::chrono::steady_clock::time_point arrived_;  // of the sample that is processed
  LatencyRecord latencies_;
  std::map<std::string, Stamp> tested_;  // the latest innovation test of each sensor that is recorded
  bool disk_failed_ = false, recording_failed_ = false;
  std::int64_t unrecorded_ = 0, unrecorded_at_checkpoint_ = 0;  // samples of the stream
  bool after_frame_ = true;  // nothing was processed since the last frame of the odometry pair
  std::optional<std::chrono::steady_clock::time_point> stopped_;
  bool catching_up_ = false;  // with what a resumed live run had recorded
  bool complete_ = false;
  bool resumed_ = false;
  std::optional<std::int64_t> resumed_from_frame_;
};

}  // namespace spartan::internal
