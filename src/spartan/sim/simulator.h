// Simulates a drive, and writes it as a recording or delivers it as a live stream.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "spartan/camera/sample_stream.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rectified_stereo.h"
#include "spartan/rig/rig.h"
#include "spartan/sim/scenario.h"

namespace spartan::sim {

/// Rectified geometry of a pair and its rotations, as the reader of the recording will compute them from the nominal
/// rig.
struct RectifiedView {
  RectifiedStereo geometry;
  Eigen::Matrix3d left_from_rectified = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d right_from_rectified = Eigen::Matrix3d::Identity();
};

/// What to simulate, and where to write it.
struct SimulationRequest {
  Scenario scenario;
  Rig rig;      ///< the rig of the scenario: calibration and truth differ from it by its errors
  Drive drive;  ///< from plan_drive()
  /// Rectification of the pairs of nominal_rig(); pairs without one get no true disparity.
  std::map<std::string, RectifiedView> views;
  std::string folder;
  bool resume = false;
};

struct SimulationProgress {
  int done = 0, frames = 0;  ///< frames done, and all frames
};

struct SimulationHooks {
  std::function<void(const SimulationProgress&)> progress;
  std::function<bool()> should_stop;
};

struct SimulationReport {
  std::int64_t frames = 0;  ///< in the recording, those of an earlier run included
  std::int64_t rays = 0;    ///< camera rays cast by this run
  double render_seconds = 0;
  bool interrupted = false;
};

/// Renders frame by frame; with `resume`, frames that are complete already are kept. Errors: `output` (the folder
/// cannot be written, or holds something else), `configuration` (the scenario is out of bounds, or the folder holds
/// another one).
Result<SimulationReport> simulate(const SimulationRequest& request, const SimulationHooks& hooks,
                                  const ThreadPool& workers);

/// The rover of a request as a live stream, with control of its cameras; `folder` and `resume` are not used. Its time
/// runs `speed` times as fast as real time and stands still while an image is rendered; with `speed` 0 every sample is
/// there at once. Images arrive as ArrivalOptions say. Until an exposure is set, each image has the one that the rule
/// of the scenario chooses; truth.disparity has no effect. Code `configuration`: the scenario is out of bounds.
Result<std::unique_ptr<SampleStream>> open_live_simulation(SimulationRequest request, double speed,
                                                           const ThreadPool& workers);

}  // namespace spartan::sim
