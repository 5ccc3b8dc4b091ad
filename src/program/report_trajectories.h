// The report's part on where the rover went: every trajectory beside the truth, its error with its 3σ, the sensors.
#pragma once

#include <string>

#include "program/json.h"
#include "spartan/core/result.h"

namespace spartan::program {

/// Plots of each trajectory of the run; where the truth is known (not empty) beside it, aligned by the first pose.
Result<std::string> trajectory_plots(const std::string& run, const std::string& truth);

/// In how many frames each sensor of the localization was ok, suspect, excluded, missing. `summary`: of the run.
std::string sensor_table(const Json& summary);

}  // namespace spartan::program
