// The report's part on what each sensor of the localization was worth.
#pragma once

#include <string>
#include <vector>

#include "program/json.h"
#include "spartan/system/run_store.h"

namespace spartan::program {

/// In how many frames each sensor was ok, suspect, excluded, missing; and when, and why, it was not ok.
std::string sensor_tables(const Json& summary, const std::vector<FrameRecord>& frames);

}  // namespace spartan::program
