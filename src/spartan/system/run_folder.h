// File layout of a run folder (docs/reference/files.md).
#pragma once

#include <string>

#include "spartan/core/result.h"
#include "spartan/core/time.h"
#include "spartan/system/run_trajectory.h"

namespace spartan {

/// Paths of the files of a run.
struct RunFolder {
  std::string path;

  std::string store() const { return path + "/run.sqlite"; }
  std::string config() const { return path + "/config.yaml"; }
  std::string rig() const { return path + "/rig.yaml"; }
  std::string terrain() const { return path + "/terrain"; }
  std::string maps() const { return path + "/maps"; }
  /// Without extension.
  std::string local_map(Stamp stamp) const { return maps() + "/local_" + std::to_string(stamp.ns); }
  /// Without extension.
  std::string global_map() const { return maps() + "/global"; }
  std::string trajectory(TrajectoryKind kind) const {
    return path + "/trajectory_" + std::string(name_of(kind)) + ".tum";
  }
  std::string report() const { return path + "/report"; }
  std::string summary() const { return path + "/summary.json"; }
  std::string log() const { return path + "/log.txt"; }
};

enum class FolderState { created, existed };

/// Creates a new folder; with `resume` an existing one is accepted. Code `output` if it exists and `resume` is false
/// (it stays untouched), or if it cannot be created.
Result<FolderState> prepare_run_folder(const RunFolder& folder, bool resume);

/// Removes the folder of a run that failed without any result.
void remove_run_folder(const RunFolder& folder);

}  // namespace spartan
