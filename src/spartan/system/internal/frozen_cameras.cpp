#include "spartan/system/internal/frozen_cameras.h"

#include <algorithm>
#include <utility>

namespace spartan::internal {
namespace {

template <class Pixel>
bool is_uniform(ImageView<const Pixel> image) {
  const Pixel first = image(0, 0);
  for (int y = 0; y < image.height(); ++y) {
    const Pixel* const row = image.row(y);
    if (!std::all_of(row, row + image.width(), [&](const Pixel& p) { return p == first; })) return false;
  }
  return true;
}

template <class Pixel>
std::uint64_t fingerprint_of(ImageView<const Pixel> image) {
  if (is_uniform(image)) return 0;
  Hash64 hash;
  const auto bytes = static_cast<std::size_t>(image.width()) * sizeof(Pixel);
  for (int y = 0; y < image.height(); ++y) hash.add(image.row(y), bytes);
  return std::max<std::uint64_t>(hash.value(), 1);
}

}  // namespace

std::uint64_t fingerprint(const FrameImage& image) {
  if (image.empty()) return 0;
  const bool wide = image.format().bytes_per_sample() == 2;
  if (image.format().layout == PixelLayout::rgb)
    return wide ? fingerprint_of(image.as<Rgb16>()) : fingerprint_of(image.as<Rgb8>());
  return wide ? fingerprint_of(image.as<std::uint16_t>()) : fingerprint_of(image.as<std::uint8_t>());
}

std::optional<std::string> FrozenCameras::find(std::size_t pair, const Fingerprints& images) const {
  const Fingerprints& latest = latest_[pair];
  const bool left = images[0] != 0 && images[0] == latest[0];
  const bool right = images[1] != 0 && images[1] == latest[1];
  if (!left && !right) return std::nullopt;
  return left && right ? "left and right image" : left ? "left image" : "right image";
}

void FrozenCameras::save(ArchiveWriter& out) const {
  out.put_array(latest_.data(), latest_.size());
}

// The rig is part of a run's identity, so the number of pairs differs only in a damaged state.
void FrozenCameras::restore(ArchiveReader& in) {
  std::vector<Fingerprints> latest = in.get_array<Fingerprints>();
  latest.resize(latest_.size());
  latest_ = std::move(latest);
}

}  // namespace spartan::internal
