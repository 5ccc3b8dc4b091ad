// Finds the two trajectories that `evaluate` compares, in runs, recordings and files.
#pragma once

#include <string>

#include "spartan/core/result.h"
#include "spartan/core/trajectory.h"

namespace spartan::program {

struct ComparedTrajectories {
  Trajectory estimate, truth;             ///< poses of the same frame, in the truth's convention
  std::string estimate_path, truth_path;  ///< the files that were read
  std::string kind;                       ///< "localization", "slam", "odometry", or "file"
};

/// `estimate`: a run folder, of which the trajectory `kind` is taken (empty: the best there is), or a trajectory file.
/// `truth`: a trajectory file or a recording with truth. Poses of a run are turned into the convention that its
/// rig.yaml states. Where only one side knows its time stamps and both have a pose for every frame (KITTI), the other
/// one takes them over line by line.
/// Errors: `input` for what is missing or unreadable, `usage` for a kind requested of a plain file, `configuration` for
/// a run whose rig is invalid.
Result<ComparedTrajectories> find_trajectories(const std::string& estimate, const std::string& truth,
                                               const std::string& kind);

/// The file of a truth that is a recording or a file, read to see that it can be: the same errors before a long run.
Result<std::string> load_truth(const std::string& path);

}  // namespace spartan::program
