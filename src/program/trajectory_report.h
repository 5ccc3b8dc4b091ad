// A comparison with ground truth as JSON (docs/reference/json.md, `evaluate`) and as a table.
#pragma once

#include <optional>
#include <string>

#include "program/json.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/report/report.h"

namespace spartan::program {

/// Both metrics of a trajectory.
struct TrajectoryScores {
  TrajectoryMetrics metrics;
  std::optional<MotionConsistency> consistency;  ///< none without the motions of the odometry
};

/// Consistency only of the odometry of a run folder; why there is none is one of the missing metrics.
Result<TrajectoryScores> score(const ComparedTrajectories& compared, const TrajectoryMetricsOptions& options);

Json to_json(const TrajectoryScores& scores, const ComparedTrajectories& compared);
std::string table_of(const TrajectoryScores& scores, const ComparedTrajectories& compared);

}  // namespace spartan::program
