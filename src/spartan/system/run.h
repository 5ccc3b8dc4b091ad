// The main job: a recording in, a run folder out.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "spartan/camera/frame_source.h"
#include "spartan/core/log.h"
#include "spartan/core/result.h"
#include "spartan/system/run_options.h"

namespace spartan {

struct RunRequest {
  std::string input;
  std::string output;
  std::string rig_file;                   ///< empty: the recording's own calibration
  std::optional<RecordingFormat> format;  ///< none: guess
  RunOptions options;
  GivenKeys given;  ///< keys of `options` that the user gave: the recording's noise does not replace them
  bool resume = false;
  int threads = 1;
  int max_frames = 0;  ///< stereo shots taken from the recording; 0: all
  std::string version;
};

struct RunProgress {
  int done = 0;
  int announced = 0;
  std::string status;
};

/// How the program listens and speaks while it works.
struct RunHooks {
  Log log;
  std::function<void(const RunProgress&)> progress;  ///< after each shot; may be empty
  std::function<bool()> should_stop;                 ///< asked between shots; may be empty
};

struct RunOutcome {
  std::string summary_json;
  bool lost = false;         ///< for part of the drive
  bool interrupted = false;  ///< stopped on request; `--resume` goes on
};

/// Codes: `input` (no recording, no usable frame), `store_damaged` (the run that is resumed), `configuration` (rig,
/// options, or a resume of another run), `output` (the folder exists already, cannot be written, disk full). What was
/// committed before an error stays.
Result<RunOutcome> run(const RunRequest& request, const RunHooks& hooks);

}  // namespace spartan
