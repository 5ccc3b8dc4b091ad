// The report's section on the sensors of the localization.
#pragma once

#include <string>
#include <vector>

#include "program/json.h"
#include "spartan/system/run_store.h"

namespace spartan::program {

/// Number of frames in which each sensor was ok, suspect, excluded, missing; and its outages with their reasons.
std::string sensor_tables(const Json& summary, const std::vector<FrameRecord>& frames);

}  // namespace spartan::program
