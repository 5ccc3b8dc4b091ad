// JPEG files. Decoding is strict: warnings of the decoder are errors.
#pragma once

#include <string_view>

#include "spartan/core/frame_image.h"
#include "spartan/core/result.h"

namespace spartan::internal {

enum class JpegColour { as_stored, gray };

/// Decodes to 8-bit gray if the file is gray or `colour` is `gray` (its luma), otherwise to 8-bit RGB. Every warning of
/// the decoder is an error of code `input`, because the decoder fills the data it cannot read with gray; the exception
/// is padding before the end marker, which some cameras write. The EXIF orientation is ignored: a calibration refers to
/// the rows and columns of the sensor.
Result<FrameImage> decode_jpeg(std::string_view content, JpegColour colour);

}  // namespace spartan::internal
