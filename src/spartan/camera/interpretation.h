// Pixel format of a decoded image file, from the calibration.
#pragma once

#include "spartan/core/frame_image.h"

namespace spartan {

/// Relabels an image of read_image() with the pixel format of the camera that took it. An image file states only the
/// bits of storage of a sample. The number of significant bits and the Bayer pattern come from the rig (`camera`) and
/// from the frame list of a recording (`bits`; 0: as the camera). Gray samples get the camera's Bayer layout; samples
/// of 16 bits get its significant bits and alignment. Samples are not changed. A format that contradicts the camera is
/// kept: the Imager converts RGB to gray for a gray camera and rejects other mismatches with both formats in the
/// message.
FrameImage interpret(const FrameImage& image, const PixelFormat& camera, int bits = 0);

}  // namespace spartan
