// The layout of a run folder (docs/reference/files.md).
#pragma once

#include <string>

#include "spartan/core/result.h"
#include "spartan/core/time.h"
#include "spartan/system/run_trajectory.h"

namespace spartan {

struct RunFolder {
  std::string path;

  std::string store() const { return path + "/run.sqlite"; }
  std::string config() const { return path + "/config.yaml"; }
  std::string rig() const { return path + "/rig.yaml"; }
  std::string terrain() const { return path + "/terrain"; }
  std::string maps() const { return path + "/maps"; }
  /// Without ending.
  std::string local_map(Stamp stamp) const { return maps() + "/local_" + std::to_string(stamp.ns); }
  /// Without ending.
  std::string global_map() const { return maps() + "/global"; }
  std::string trajectory(TrajectoryKind kind) const {
    return path + "/trajectory_" + std::string(name_of(kind)) + ".tum";
  }
  std::string report() const { return path + "/report"; }
  std::string summary() const { return path + "/summary.json"; }
  std::string log() const { return path + "/log.txt"; }
};

enum class FolderState { made, was_there };

/// Makes a new folder, or with `resume` accepts one that is there. Code `output` where it exists and is not to be
/// resumed (it is left untouched), or where it cannot be made.
Result<FolderState> prepare_run_folder(const RunFolder& folder, bool resume);

/// Removes a folder that was made for a run which came to nothing.
void remove_run_folder(const RunFolder& folder);

}  // namespace spartan
