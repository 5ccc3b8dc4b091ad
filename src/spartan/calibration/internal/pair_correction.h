// Correction of a rig by the errors found in its images.
#pragma once

#include "spartan/calibration/internal/hypothesis_search.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// Errors that were found beside swapped cameras and sizes.
struct FoundErrors {
  bool yaw = false, focal_ratio = false, distortion = false;
};

/// The smallest correction that makes the rows agree: pitch and roll, the errors that were found, and the baseline
/// direction only where the rows need it. Rows observe yaw, focal ratio and baseline direction weakly, while errors in
/// these cost range accuracy.
PairCorrection minimal_correction(const FittedHypothesis& fitted, const FoundErrors& found);

/// The rig with the hypothesis and the correction applied to the pair. `wrong_unit`: converts the baseline from its
/// likely_unit() to metres, where there is one. The vignetting centre is scaled with the image size and moves with the
/// principal point; the self-mask file is not changed.
Rig corrected_rig(Rig rig, const StereoPair& pair, const PairHypothesis& hypothesis, const PairCorrection& correction,
                  bool wrong_unit);

}  // namespace spartan::internal
