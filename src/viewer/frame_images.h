// Where the page of a run gets the images of its frames from.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "spartan/camera/recording.h"
#include "spartan/camera/recording_writer.h"
#include "spartan/core/result.h"
#include "spartan/rig/rig.h"
#include "spartan/system/run_folder.h"

namespace spartan::viewer {

/// Images of the recording that was named, else those that a live run records, else those of the recording that the run
/// states.
class FrameImages {
 public:
  /// `named`: as on the command line; what it leaves open is as the run states it.
  FrameImages(RunFolder run, const RunInput& named);

  bool exist() const;
  /// Whether a live run has both images of a frame on disk; those of a recording all are.
  bool has_both(const std::string& pair, Stamp stamp) const;
  /// One image alone where the other one is missing. `rig`: of the run. Code `input`: there is none, or not yet.
  Result<StereoFrame> read(const std::string& pair, Stamp stamp, const Rig& rig);

 private:
  RecordedImages find_own(const std::string& pair, Stamp stamp) const;

  RunFolder run_;
  bool are_own_;  // named by nobody: a live run may have recorded them
  Result<RunInput> input_;
  std::unique_ptr<Recording> recording_;  // opened at the first image
};

}  // namespace spartan::viewer
