// The report page of a run: images, trajectories, sensors, maps, and errors where the truth is known.
#pragma once

#include <string>

#include "spartan/camera/frame_source.h"
#include "spartan/core/result.h"
#include "spartan/system/run_options.h"

namespace spartan::program {

struct ReportRequest {
  std::string run;           ///< run folder
  std::string recording;     ///< the recording it was made from
  OpenOptions open;          ///< how the recording was opened
  RunOptions options;        ///< options of the run
  std::string truth;         ///< truth for `find_trajectories`; empty: that of the recording, if any
  bool whole_truth = false;  ///< also show disparity errors and the true elevation of a simulation
  int threads = 1;
};

/// One self-contained HTML page.
Result<std::string> make_report(ReportRequest request);

}  // namespace spartan::program
