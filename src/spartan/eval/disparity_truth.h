// Ground-truth disparities and masks from files.
#pragma once

#include <cstdint>
#include <string>

#include "spartan/core/image.h"
#include "spartan/core/result.h"

namespace spartan {

/// Reads disparities in px, NaN where unknown. The format is recognized by the content of the file:
/// - PFM: values as they are; inf is unknown.
/// - 16-bit PNG: value / 256; 0 is unknown (KITTI).
/// - 8-bit PNG (gray, or RGB with equal channels): value / `scale_of_8_bit`; 0 is unknown (Middlebury).
/// Fails with code `input` for anything else, `usage` where the scale is not positive.
Result<Image<float>> read_disparity(const std::string& path, double scale_of_8_bit = 1);

/// Reads a mask: 255 seen by both cameras, 128 occluded in the right image, 0 without truth. Fails with code `input` on
/// other values.
Result<Image<std::uint8_t>> read_truth_mask(const std::string& path);

}  // namespace spartan
