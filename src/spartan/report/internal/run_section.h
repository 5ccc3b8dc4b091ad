// The report's section on the run itself: cameras, times, memory, command line, files.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "spartan/camera/recording.h"
#include "spartan/report/report.h"

namespace spartan::internal {

/// The pairs of the rig as a table.
std::string rig_section(const Rig& rig);
/// Time of each stage, frames per second, memory.
std::string time_section(const nlohmann::ordered_json& summary);
/// Version, date, command line, and links to every file of the run folder, relative to the folder of the page.
std::string run_section(const nlohmann::ordered_json& summary, const ReportRequest& request, const RecordingInfo& info);

}  // namespace spartan::internal
