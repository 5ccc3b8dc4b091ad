// Detects cameras that deliver the same image again.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/archive.h"

namespace spartan::internal {

/// Hash of an image's size and pixels. 0 for an image without pixels or with one value in all pixels: a dark or
/// saturated image repeats legitimately.
std::uint64_t fingerprint(const FrameImage& image);

/// Remembers the fingerprints of the latest images of every stereo pair. The noise of a sensor never repeats, so an
/// image that equals the previous one of its camera, bit for bit, comes from a camera or driver that has stalled.
class FrozenCameras {
 public:
  using Fingerprints = std::array<std::uint64_t, 2>;  ///< left, right

  explicit FrozenCameras(std::size_t pairs) : latest_(pairs) {}

  static Fingerprints fingerprints_of(const StereoFrame& frame) {
    return {fingerprint(frame.left), fingerprint(frame.right)};
  }

  /// Which images equal the previous ones of the pair with that index: "left image", "right image" or "left and right
  /// image"; nothing where both are new.
  std::optional<std::string> find(std::size_t pair, const Fingerprints& images) const;

  /// The images of a frame that was accepted.
  void remember(std::size_t pair, const Fingerprints& images) { latest_[pair] = images; }

  void save(ArchiveWriter& out) const;
  void restore(ArchiveReader& in);

 private:
  std::vector<Fingerprints> latest_;  ///< of each pair of the rig; 0: none
};

}  // namespace spartan::internal
