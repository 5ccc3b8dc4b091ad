// Putting a rig right by what its pictures said.
#pragma once

#include "spartan/rig/inspection/belief_search.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// What was found wrong beside eyes and sizes.
struct FoundWrong {
  bool yaw = false, focal_ratio = false, distortion = false;
};

/// The belief's correction by no more than is needed: pitch and roll, what was found, and what the rows cannot do
/// without. Rows tell a yaw, a focal ratio and the baseline's direction with little force, and a wrong one costs range.
PairCorrection needed_correction(const BelievedPair& believed, const FoundWrong& found);

/// The rig with the pair as it is believed and corrected. `wrong_unit`: the baseline is brought to metres from its
/// likelier_unit(), where there is one. The vignetting's centre goes with the size and the principal point; a self-mask
/// stays the file that it was.
Rig mended_rig(Rig rig, const StereoPair& pair, const PairBelief& belief, const PairCorrection& correction,
               bool wrong_unit);

}  // namespace spartan
