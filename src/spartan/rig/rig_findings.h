// What looks like a mistake in a calibration rather than a rig.
#pragma once

#include <optional>
#include <string>
#include <string_view>
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
/// pictures tell which), `baseline_unit` (beyond 3 m or below 5 mm), `size_mismatch` (principal point, view, fx and fy
/// more than 5 % apart, and the pictures' size where that is known; once for two equal eyes), `not_beside` (then
/// nothing is said about sides), `eyes_apart`.
std::vector<RigFinding> find_doubts(const Rig& rig, const StereoPair& pair, ImageSize picture_size = {});

/// The unit that a baseline which was read as metres more likely had: millimetres (30 and more), centimetres (10 and
/// more), kilometres (below 0.005: divided by 1000 twice). Between these nothing is sure.
struct BaselineUnit {
  std::string_view name;
  double metres = 1;
};
std::optional<BaselineUnit> likelier_unit(double baseline_m);

/// How much larger pictures are than those of the calibration; none where their shapes differ (by more than 1 %).
std::optional<double> size_factor(ImageSize calibration, ImageSize picture);

/// What to multiply the model's size by where its principal point would be the middle of other pictures.
std::optional<double> size_told_by_centre(const Camera& camera);

/// fx and fy that differ by more than most pixels' shape (5 %), or than any (30 %).
enum class AspectDoubt { none, some, strong };
AspectDoubt doubt_of_aspect(const Camera& camera);

/// Whether there are lenses of such a view: a focal length between 0.1 and 20 times the picture's width.
bool has_possible_focal(const Camera& camera);

/// Whether the camera is a pinhole within 0.5 px all over its picture.
bool is_linear(const Camera& camera);

}  // namespace spartan
