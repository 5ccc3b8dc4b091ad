// A figure of the ground that a rig's pairs see: side view, and plan with the pans.
#pragma once

#include <optional>

#include "program/drawing.h"
#include "spartan/rig_design/rig_designer.h"

namespace spartan::program {

/// Of the selected pairs (PairDesign::selected); none where there is no wide pair to draw.
std::optional<Drawing> draw_ground(const RigRequirements& requirements, const RigDesign& design);

}  // namespace spartan::program
