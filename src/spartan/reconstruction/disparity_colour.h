// Disparities as a picture for people.
#pragma once

#include "spartan/core/image.h"

namespace spartan {

/// Near is warm, far is cold (Google's "turbo" map), unknown is black; the colours span the 1st to the 99th percentile.
Image<Rgb8> colour_disparity(ImageView<const float> disparity);

}  // namespace spartan
