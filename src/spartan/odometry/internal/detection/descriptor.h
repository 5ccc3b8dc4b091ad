// Descriptors of features, and the distance of two of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace spartan::internal {

/// What the bytes of a descriptor hold. Descriptors of different kinds never match.
enum class DescriptorKind : std::uint8_t {
  surf,   ///< unit vector of 64 signed entries, each multiplied by 254 and rounded (entries beyond ±1/2 saturate)
  sift,   ///< unit vector of 128 entries from 0 to 1/2, each multiplied by 512 and rounded
  orb,    ///< 256 bits
  akaze,  ///< 486 bits
};

/// Bytes that a kind uses. They differ, so that a saved descriptor tells its kind by its length.
constexpr std::size_t bytes_of(DescriptorKind kind) {
  switch (kind) {
    case DescriptorKind::surf:
      return 64;
    case DescriptorKind::sift:
      return 128;
    case DescriptorKind::orb:
      return 32;
    case DescriptorKind::akaze:
      return 61;
  }
  return 0;
}
/// The kind of descriptors of that length; none where there is no such kind.
std::optional<DescriptorKind> descriptor_kind_of(std::size_t bytes);

struct Descriptor {
  static constexpr std::size_t kMaxBytes = 128;
  DescriptorKind kind = DescriptorKind::surf;
  std::array<std::int8_t, kMaxBytes> bytes{};  ///< beyond bytes_of(kind): 0
  friend bool operator==(const Descriptor&, const Descriptor&) = default;
};

/// Squared distance of two descriptors, from 0 to 4; infinite where their kinds differ. SURF: Euclidean distance of the
/// unit vectors. The others are scaled so that features of different scenes are as far apart as with SURF
/// (docs/math/odometry.md, "Other detectors"): the options for distances then hold for every detector.
double squared_distance(const Descriptor& a, const Descriptor& b);

}  // namespace spartan::internal
