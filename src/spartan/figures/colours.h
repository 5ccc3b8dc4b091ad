// Colours of figures.
#pragma once

#include <string>

#include "spartan/core/image.h"

namespace spartan {

/// "#rrggbb"
std::string hex(const Rgb8& colour);

/// Blue over white to red; `value` 0 … 1. For signed values.
Rgb8 cold_to_hot(double value);

}  // namespace spartan
