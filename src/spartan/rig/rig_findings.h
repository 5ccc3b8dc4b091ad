// Plausibility checks of a calibration by its numbers alone, without images.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/rig/rig.h"

namespace spartan {

/// A suspected error of a calibration. `id` is one of those in docs/reference/json.md.
struct RigFinding {
  std::string id;
  std::string text;  ///< one sentence: what is suspicious, and what to check
  double value = 0;  ///< the quantity it is based on, in the unit that the text names
};

/// Plausibility findings of a pair:
/// - `inverse_transform` and `swapped_eyes`, always together: the right camera is on the left (only images can decide);
/// - `not_beside`: the baseline is not mainly along x of the left camera (the sides are then not checked);
/// - `baseline_unit`: a baseline beyond 3 m or below 5 mm;
/// - `eyes_apart`: cameras rotated relative to each other by more than 15°;
/// - `size_mismatch`: principal point, field of view or fx/fy (more than 5 % apart) suggest another image size, or
///   `image_size` differs, where that is known. Reported once for two equal cameras.
std::vector<RigFinding> plausibility_findings(const Rig& rig, const StereoPair& pair, ImageSize image_size = {});

/// The unit that a baseline which was read as metres probably has.
struct BaselineUnit {
  std::string_view name;
  double metres = 1;  ///< of one unit
};
/// Millimetres from 30 on, centimetres from 10 on, kilometres (divided by 1000 twice) below 0.005. None in between:
/// the value may be right.
std::optional<BaselineUnit> likely_unit(double baseline_m);

/// Image size over the size for which a camera was calibrated; none where the aspect ratios differ by more than 1 %.
std::optional<double> size_factor(ImageSize calibration, ImageSize image_size);

/// The factor by which to scale a camera model whose principal point would be the centre of images of another size;
/// none where the principal point is plausible.
std::optional<double> size_factor_from_centre(const Camera& camera);

/// How far fx and fy are apart: `notable` from 5 % on, more than the pixels of most sensors; `implausible` from 30 %
/// on.
enum class AspectDeviation { none, notable, implausible };
AspectDeviation aspect_deviation(const Camera& camera);

/// Whether the focal length is between 0.1 and 20 times the image width.
bool has_plausible_focal_length(const Camera& camera);

/// Whether the camera model equals a pinhole within 0.5 px all over the image.
bool is_distortion_free(const Camera& camera);

}  // namespace spartan
