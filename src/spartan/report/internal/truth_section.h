// The report's section on the truth of a simulation: disparity errors and the true elevation.
#pragma once

#include <string>

#include "spartan/camera/recording.h"
#include "spartan/core/result.h"
#include "spartan/imaging/imager.h"
#include "spartan/report/report.h"

namespace spartan::internal {

Result<std::string> truth_section(Recording& source, Imager& imager, const ReportRequest& request);

}  // namespace spartan::internal
