#include "spartan/odometry/internal/landmarks/landmark.h"

#include <algorithm>
#include <stdexcept>

namespace spartan::internal {

const Anchor& LandmarkMemory::anchor(std::uint32_t id) const {
  // Anchors get increasing ids and are never reordered.
  const auto found = std::lower_bound(anchors.begin(), anchors.end(), id,
                                      [](const Anchor& a, std::uint32_t wanted) { return a.id < wanted; });
  if (found == anchors.end() || found->id != id) throw std::logic_error("LandmarkMemory: no such anchor");
  return *found;
}

void LandmarkMemory::drop_unused_anchors() {
  std::erase_if(anchors, [&](const Anchor& a) {
    return std::none_of(landmarks.begin(), landmarks.end(), [&](const Landmark& l) { return l.anchor_id == a.id; });
  });
}

}  // namespace spartan::internal
