// The report's section on the sensors of the localization.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "spartan/system/run_store.h"

namespace spartan::internal {

using Json = nlohmann::ordered_json;

/// Number of frames in which each sensor was ok, suspect, excluded, missing; and its outages with their reasons.
std::string sensor_tables(const Json& summary, const std::vector<FrameRecord>& frames);

}  // namespace spartan::internal
