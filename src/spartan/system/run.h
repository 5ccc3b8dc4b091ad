// Runs the pipeline over a recording or a live stream and writes a run folder (`spartan run`).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "spartan/camera/recording.h"
#include "spartan/camera/recording_writer.h"
#include "spartan/core/files.h"
#include "spartan/core/log.h"
#include "spartan/core/result.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// What to run, and with which options.
struct RunRequest {
  std::string input;   ///< folder of the recording; not used by run_live()
  OpenOptions open;    ///< how to read it
  std::string output;  ///< run folder
  RunOptions options;
  GivenKeys given;       ///< keys of `options` that the user gave: the recording's noise does not replace them
  bool resume = false;   ///< continue the run in `output`, if there is one
  bool replace = false;  ///< replace the run in `output`, if there is one, once a frame was processed
  int threads = 1;
  std::int64_t memory_bytes = 0;  ///< refuse recordings that need more, see Pipeline::check_memory(); 0: no bound
  int max_frames = 0;   ///< number of stereo frames of the odometry pair to process, missing ones included; 0: all
  bool record = false;  ///< run_live(): record the stream in the run folder
  ImageFiles recorded_images = ImageFiles::pnm;
  double watchdog_s = 0;  ///< see RunHooks::hung; 0: no watchdog
  /// run_live(): address of the pan-tilt unit, see open_pan_tilt(); empty: that of the stream, if it has one.
  std::string pan_tilt;
  std::string version;
};

struct RunProgress {
  int done = 0;           ///< frames of the odometry pair, missing ones included
  int total = 0;          ///< those that the recording lists, at most RunRequest::max_frames; 0: unknown
  double distance_m = 0;  ///< path length of the odometry
  std::string status;     ///< of the last frame: FrameRecord::status
};

/// What the rover's computer can ask of a live run.
enum class RunCommand {
  panorama,  ///< take one as soon as the rover is stationary
  stop,      ///< end the run, as RunHooks::should_stop does
};

/// The begin or the end of a panorama; the rover should be stationary in between.
struct PanoramaEvent {
  bool begins = false;
  std::int64_t position_id = 0;
  Stamp stamp;    ///< of the latest frame of the stream
  int views = 0;  ///< at its end: the frames that were taken
};

/// Callbacks of a run, called by the thread that called run(), except where another one is named. Each may be empty.
struct RunHooks {
  Log log;
  std::function<void(const RunProgress&)> progress;  ///< after each frame
  std::function<bool()> should_stop;                 ///< asked before each sample; a recorded run ends with a frame
  /// The localization at the newest sample: after each sample of the IMU and each frame.
  std::function<void(const LocalizationEstimate&)> estimate;
  std::function<void(const FrameRecord&)> frame;  ///< each frame of the odometry pair, missing ones included
  /// Each map that was applied, when its files are written; `has_files`: false where the disk was full or too slow for
  /// them. Called by any thread.
  std::function<void(const MappedStop&, bool has_files)> map;
  std::function<std::optional<RunCommand>()> command;  ///< asked between the samples of a live stream, until empty
  std::function<void(const PanoramaEvent&)> panorama;  ///< called by another thread
  /// Called once, by another thread, where a stage takes longer than RunRequest::watchdog_s (of the back end and of the
  /// disk: ten times as long): the run does not end by itself, so this function should end the process.
  std::function<void(const std::string& stage, double seconds)> hung;
};

struct RunOutcome {
  std::string summary_json;
  bool lost = false;         ///< the odometry was lost at least once
  bool interrupted = false;  ///< stopped by should_stop; can be resumed
  /// Keeps other processes out of the run folder. Declared last: files that the caller adds are written before.
  FolderLock lock;
};

/// Codes: `input` (no recording, no usable frame), `store_damaged` (the run to be resumed), `configuration` (rig,
/// options, or resuming another run), `output` (the folder already exists, is in use by another process, cannot be
/// written, disk full), `read_error` and `resources` (a file of the recording cannot be read now, or memory ran out:
/// the run can be resumed). Everything that was committed before an error remains.
Result<RunOutcome> run(const RunRequest& request, const RunHooks& hooks);

/// Runs over a live stream until it ends, RunRequest::max_frames were processed, or RunHooks::should_stop says so. A
/// thread reads the stream into a queue; where the queue is full, frames are dropped, those of other pairs than that of
/// the odometry first, and counted. With RunRequest::resume, what the run
/// had recorded after its last checkpoint is processed first; then the stream goes on. Codes: as run(), and those of
/// SampleStream::read().
Result<RunOutcome> run_live(SampleStream& stream, const RunRequest& request, const RunHooks& hooks);

}  // namespace spartan
