// Text about pan coverage for warnings, reports and figures. `degrees` is the unit after an angle.
#pragma once

#include <string>

#include "spartan/rig_design/pan_coverage.h"

namespace spartan {

/// "-58.5 to 58.5 deg", a list of the sectors, or "nowhere".
std::string to_text(const AzimuthSet& set, const std::string& degrees = " deg");
/// "overlap by 30.0 %", or "leave a gap of 30.0 deg".
std::string to_text(const PanOverlap& overlap, const std::string& degrees = " deg");
/// One sentence about the overlap of neighbouring pans, of which there must be at least two.
std::string describe_overlaps(const PanCoverage& pans, const std::string& degrees = " deg");

}  // namespace spartan
