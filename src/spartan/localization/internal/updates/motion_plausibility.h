// What the motions before say about a visual motion.
#pragma once

#include "spartan/localization/internal/filter_memory.h"

namespace spartan::internal {

/// Whether a motion is far off what a speed between zero and the last one can explain. While the cameras stand, or show
/// the same frame, the rover may have moved on.
bool is_implausible(const RecentMotion& recent, const RelativeMotion& motion);

/// Adds a motion that was used; stationary ones do not count. The length of an uncertain one counts as far as it was
/// plausible.
void remember(RecentMotion& recent, const RelativeMotion& motion, bool uncertain);

}  // namespace spartan::internal
