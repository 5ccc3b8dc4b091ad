// True disparities and masks from files.
#pragma once

#include <cstdint>
#include <string>

#include "spartan/core/image.h"
#include "spartan/core/result.h"

namespace spartan {

/// Disparities in px, NaN where unknown. What the file is shows in its content:
/// - PFM: as they are; inf is unknown.
/// - 16-bit PNG: value / 256; 0 is unknown (KITTI).
/// - 8-bit PNG (gray, or RGB with equal channels): value / `scale_of_8_bit`; 0 is unknown (Middlebury).
/// Code `input` for anything else, `usage` for a scale that is not positive.
Result<Image<float>> read_disparity(const std::string& path, double scale_of_8_bit = 1);

/// 255 scored and seen by both eyes, 128 occluded, 0 no truth; other values are refused with code `input`.
Result<Image<std::uint8_t>> read_truth_mask(const std::string& path);

}  // namespace spartan
