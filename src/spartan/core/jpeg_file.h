// JPEG pictures, decoded so that damage is noticed.
#pragma once

#include <string_view>

#include "spartan/core/frame_image.h"
#include "spartan/core/result.h"

namespace spartan {

enum class JpegColour { as_stored, gray };

/// Gray stays gray, all else becomes RGB of 8 bits (or gray, from its luma, where that is asked for). Any complaint of
/// the decoder is an error of code `input`, but for padding before the end marker, which some cameras write: it would
/// fill what it cannot read with gray and go on. A picture is never turned, whatever its EXIF part says: calibrations
/// hold for the sensor's own rows and columns.
Result<FrameImage> decode_jpeg(std::string_view content, JpegColour colour);

}  // namespace spartan
