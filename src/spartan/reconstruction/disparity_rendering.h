// Disparity images rendered in colour.
#pragma once

#include "spartan/core/image.h"

namespace spartan {

/// Renders disparities with Google's "turbo" colour map: large disparities (near) are red, small ones (far) blue,
/// unknown pixels (NaN) black. The colour range spans the 1st to the 99th percentile of the known disparities.
Image<Rgb8> colour_disparity(ImageView<const float> disparity);

}  // namespace spartan
