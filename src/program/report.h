// The report page of a run: what was seen, where the rover went, what it found, how right it was.
#pragma once

#include <string>

#include "spartan/camera/frame_source.h"
#include "spartan/core/result.h"
#include "spartan/system/run_options.h"

namespace spartan::program {

struct ReportRequest {
  std::string run;           ///< the run's folder
  std::string recording;     ///< that it was made from
  OpenOptions open;          ///< how that was opened
  RunOptions options;        ///< that the run was made with
  std::string truth;         ///< what `find_trajectories` takes for the truth; empty: the recording's, where it has one
  bool whole_truth = false;  ///< besides, how right the matcher is and how the ground is, as a simulation knows them
  int threads = 1;
};

/// One self-contained HTML page.
Result<std::string> make_report(ReportRequest request);

}  // namespace spartan::program
