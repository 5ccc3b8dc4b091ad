// Significant bits of 16-bit images whose calibration does not state them.
#pragma once

#include <span>

#include "spartan/camera/internal/recording_index.h"
#include "spartan/core/frame_image.h"

namespace spartan::internal {

/// The significant bits of gray samples, 10, 12, 14 or 16, and where they are: all values are multiples of a power of
/// two (high), or all are below one (low). Dark images look as if they had fewer bits. `image` has 16 bits.
PixelFormat sample_format_of(std::span<const FrameImage> images);

/// Sets the pixel formats of cameras whose calibration states 8 bits, the default, and whose images have 16: by `bits`
/// if above 0, else by sample_format_of() of some images, with a remark. Cameras of frames with a stated number are
/// left alone. Codes: `resources`, `read_error`.
Status set_sample_depth(RecordingIndex& index, int bits);

}  // namespace spartan::internal
