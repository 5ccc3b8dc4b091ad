// Self-masks of a rig that is stored elsewhere.
#pragma once

#include <string>

#include "spartan/core/result.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// Copies the images of self-masks, whose names are relative to the folder `from`, to masks/CAMERA.EXTENSION of the
/// folder `to`. Returns the rig with these names. Codes: `configuration` (a mask is missing or unreadable), `output`.
Result<Rig> with_self_masks_in(const std::string& to, Rig rig, const std::string& from);

}  // namespace spartan::internal
