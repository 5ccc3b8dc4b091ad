// What pans see, in words for warnings, reports and pictures. `degrees` is the sign after an angle.
#pragma once

#include <string>

#include "spartan/rig/design/pan_view.h"

namespace spartan {

/// "-58.5 to 58.5 deg", each sector of it, or "nowhere".
std::string in_words(const AzimuthSet& set, const std::string& degrees = " deg");
/// "overlap by 30.0 %", or "leave a gap of 30.0 deg".
std::string in_words(const PanOverlap& overlap, const std::string& degrees = " deg");
/// One sentence on neighbouring pans; there must be more than one.
std::string overlaps_in_words(const PanFigures& pans, const std::string& degrees = " deg");

}  // namespace spartan
