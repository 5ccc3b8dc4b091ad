// What the samples of a picture file stand for.
#pragma once

#include "spartan/core/frame_image.h"

namespace spartan {

/// A picture as read_image() gives it, as an image of the camera that took it. A file says how many bits a sample takes
/// up; how many of them carry signal, and which colours they stand for, is known to the rig (`camera`) and to a
/// recording's list of shots (`bits`; 0: as the camera). Gray samples become the camera's mosaic, deep ones get its
/// bits and alignment. No sample is changed, and what does not fit is left as it is: imaging reduces colours to gray
/// where the camera is gray, and refuses the rest with both formats.
FrameImage interpret(const FrameImage& image, const PixelFormat& camera, int bits = 0);

}  // namespace spartan
