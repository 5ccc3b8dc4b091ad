// What looks like a mistake in a calibration rather than a rig.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/rig/rig.h"

namespace spartan {

/// `id` is one of those in docs/formats.md ("rig inspect").
struct RigFinding {
  std::string id;
  std::string text;
  double value = 0;  ///< the figure it rests on, in the unit that the text names
};

/// From the numbers alone: `inverse_transform` and `swapped_eyes` together where the right eye stands on the left (only
/// pictures tell which), `baseline_unit`, `size_mismatch` (principal point, focal lengths, and the pictures' size where
/// that is known), `not_beside`, `eyes_apart`.
std::vector<RigFinding> find_doubts(const Rig& rig, const StereoPair& pair, ImageSize picture_size = {});

/// How many times as large the camera's pictures are as those of its calibration, by a principal point that would be
/// the middle of those; none where it lies about the middle of the camera's own.
std::optional<double> size_factor_by_centre(const Camera& camera);

/// Whether the camera is a pinhole within 0.5 px all over its picture.
bool is_linear(const Camera& camera);

}  // namespace spartan
