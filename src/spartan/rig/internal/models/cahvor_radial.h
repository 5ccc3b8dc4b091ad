// The domain of the radial map of CAHVOR and CAHVORE.
#pragma once

#include "spartan/rig/models/camera_model.h"

namespace spartan::internal {

/// The smallest positive root of d(x (1 + r0 + r1 x² + r2 x⁴))/dx, where the radial map of CAHVOR and CAHVORE stops
/// increasing. Infinity if there is none; 0 if the map decreases at 0 or a coefficient is not finite.
double cahvor_monotonic_limit(const CahvorModel::Radial& radial);

}  // namespace spartan::internal
