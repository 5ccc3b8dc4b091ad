#include "spartan/system/internal/frozen_cameras.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace spartan::internal {
namespace {

/// One step of a multiplicative hash; the factor is 2⁶⁴ divided by the golden ratio (Knuth, TAOCP 3, 6.4).
std::uint64_t mixed(std::uint64_t hash, std::uint64_t word) {
  hash = (hash ^ word) * 0x9E3779B97F4A7C15U;
  return hash ^ (hash >> 32U);
}

/// The bytes eight at a time, since every image of a run is hashed.
std::uint64_t hash_row(std::uint64_t hash, const void* row, std::size_t bytes) {
  const auto* at = static_cast<const unsigned char*>(row);
  std::uint64_t word = 0;
  for (; bytes >= sizeof word; at += sizeof word, bytes -= sizeof word) {
    std::memcpy(&word, at, sizeof word);
    hash = mixed(hash, word);
  }
  word = 0;
  std::memcpy(&word, at, bytes);
  return mixed(hash, word);
}

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
  std::uint64_t hash = mixed(mixed(0, static_cast<std::uint64_t>(image.width())),
                             static_cast<std::uint64_t>(image.height()) * sizeof(Pixel));
  const auto bytes = static_cast<std::size_t>(image.width()) * sizeof(Pixel);
  for (int y = 0; y < image.height(); ++y) hash = hash_row(hash, image.row(y), bytes);
  return hash == 0 ? 1 : hash;
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
