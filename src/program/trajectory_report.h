// A comparison with ground truth as JSON (docs/reference/json.md, `evaluate`) and as a table.
#pragma once

#include <string>

#include "program/json.h"
#include "spartan/eval/trajectory_metrics.h"
#include "spartan/report/report.h"

namespace spartan::program {

Json to_json(const TrajectoryMetrics& metrics, const ComparedTrajectories& compared);
std::string table_of(const TrajectoryMetrics& metrics, const ComparedTrajectories& compared);

}  // namespace spartan::program
