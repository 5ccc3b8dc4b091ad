// What a run computes with, chosen by its stream and the first frames.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/sample_stream.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

struct RunSetup {
  Rig rig;             ///< rows of its pairs aligned
  RunOptions options;  ///< with the noise of the recording and the scale of the maps
  Pipeline pipeline;
  std::optional<Eigen::Vector3d> ground_up;  ///< body frame; for recordings that do not tell where up is
  std::vector<std::string> sentences;        ///< what was chosen, for the log
};

/// Checks that the run fits into memory and that its folder can be used before anything takes long. `before`: identity
/// of the live run that is resumed, whose rig and options are used as they were chosen then; null: the first images
/// choose. Codes: `usage`, `input`, `output`, `resources`, `configuration` (also of `before`).
Result<RunSetup> set_up_run(SampleStream& source, const RunRequest& request, const ThreadPool& workers, Pace pace,
                            const RunIdentity* before);

}  // namespace spartan::internal
