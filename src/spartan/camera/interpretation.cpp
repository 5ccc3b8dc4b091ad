#include "spartan/camera/recording.h"

namespace spartan {

FrameImage interpret(const FrameImage& image, const PixelFormat& camera, int bits) {
  PixelFormat format = image.format();
  if (format.layout == PixelLayout::gray && camera.layout != PixelLayout::rgb) format.layout = camera.layout;
  if (format.bits > 8) {
    if (bits == 0) bits = camera.bits;
    if (bits > 8) format.bits = bits;
    format.alignment = camera.alignment;
  }
  return image.with_format(format);
}

}  // namespace spartan
