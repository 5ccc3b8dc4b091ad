#include "spartan/camera/internal/sample_depth.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <vector>

#include "spartan/image_io/image_io.h"

namespace spartan::internal {
namespace {

constexpr std::size_t kProbes = 4;  // images of a camera

// Up to kProbes readable images, spread over the frames of a pair. Empty where the first one has 8 bits.
Result<std::vector<FrameImage>> deep_images(const std::vector<const FrameEntry*>& frames) {
  std::vector<FrameImage> images;
  for (std::size_t k = 0; k < std::min(kProbes, frames.size()); ++k) {
    auto image = read_image(frames[k * frames.size() / std::min(kProbes, frames.size())]->left_file);
    if (!image && image.error().code != ErrorCode::input) return failure(image);
    if (!image) continue;
    if (image->format().bits <= 8) return images;
    images.push_back(std::move(*image));
  }
  return images;
}

template <class Pixel, class Visit>
void for_each_pixel(ImageView<const Pixel> image, Visit visit) {
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) visit(image(x, y));
  }
}

}  // namespace

PixelFormat sample_format_of(std::span<const FrameImage> images) {
  unsigned all = 0;  // bits that are set in any sample
  for (const FrameImage& image : images) {
    if (image.format().layout == PixelLayout::rgb) {
      for_each_pixel(image.as<Rgb16>(), [&](const Rgb16& p) { all |= p.r | p.g | p.b; });
    } else {
      for_each_pixel(image.as<std::uint16_t>(), [&](std::uint16_t p) { all |= p; });
    }
  }
  PixelFormat format;
  format.bits = 16;
  if (all == 0) return format;
  const int unused_low = std::countr_zero(all), highest = static_cast<int>(std::bit_width(all));
  const bool high = unused_low > 0 && highest > 14;
  format.alignment = high ? BitAlignment::high : BitAlignment::low;
  const int needed = high ? 16 - unused_low : highest;
  for (const int bits : {10, 12, 14, 16}) {
    if (needed > bits) continue;
    format.bits = bits;
    break;
  }
  if (format.bits == 16) format.alignment = BitAlignment::low;
  return format;
}

Status set_sample_depth(RecordingIndex& index, int bits) {
  if (index.video) return {};
  Rig& rig = index.info.rig;
  for (const StereoPair& pair : rig.pairs) {
    std::vector<const FrameEntry*> frames;
    for (const FrameEntry& entry : index.frames) {
      if (entry.pair == pair.name && entry.bits == 0 && !entry.fault) frames.push_back(&entry);
    }
    if (frames.empty()) continue;
    const auto images = deep_images(frames);
    if (!images) return failure(images);
    if (images->empty()) continue;
    PixelFormat found = sample_format_of(*images);
    if (bits > 8) found.bits = bits;
    bool changed = false;
    for (Camera& camera : rig.cameras) {
      const bool of_pair = camera.name == pair.left || camera.name == pair.right;
      if (!of_pair || (camera.pixel_format.bits > 8 && bits == 0)) continue;
      camera.pixel_format.bits = found.bits;
      camera.pixel_format.alignment = found.alignment;
      changed = true;
    }
    if (!changed) continue;
    index.info.sequence.remarks.push_back(
        fmt::format("pair '{}': {} significant bits in the {} bits of 16-bit images, {}", pair.name, found.bits,
                    found.alignment == BitAlignment::high ? "high" : "low",
                    bits > 8 ? "as stated" : "as far as the images show (--bits states another number)"));
  }
  return {};
}

}  // namespace spartan::internal
