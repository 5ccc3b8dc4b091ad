// A rig as text, plausibility checks of its numbers, and the differences of two rigs.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/core/pose.h"
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
/// - `not_side_by_side`: the baseline is not mainly along x of the left camera (the sides are then not checked);
/// - `baseline_unit`: a baseline beyond 3 m or below 5 mm;
/// - `large_rotation`: cameras rotated relative to each other by more than 15°;
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

/// "120.0 mm", "1.200 m".
std::string describe_length(double metres);

/// "120.0 mm to the right, 0.3 mm up, 0.1 mm back; rotated 0.020° to the left, …": pose of the second optical frame in
/// the first one (x right, y down, z forward).
std::string describe_relative_pose(const Pose& first_from_second);

/// Geometry of one pair as `rig inspect --json` prints it; focal length and fields of view are those of the left
/// camera.
struct PairSummary {
  std::string name;
  double baseline_m = 0;
  double focal_px = 0;                ///< pixels per radian on the optical axis
  double hfov_deg = 0, vfov_deg = 0;  ///< through the image centre, from border to border; NaN where undefined
};
PairSummary summarize_pair(const Rig& rig, const StereoPair& pair);

/// Lines about every camera and pair: model, image size, fields of view, pose in the body frame, pose of the right
/// camera relative to the left one, and range resolution at 0.5 … 20 m for 0.3 px of disparity (Δz = z² c / (f b)).
std::vector<std::string> describe_rig(const Rig& rig);

/// One line per finding of plausibility_findings(), what is implausible about a pair by its numbers alone.
std::vector<std::string> describe_plausibility(const Rig& rig, const StereoPair& pair);

/// A value in which two rigs differ.
struct RigDifference {
  std::string key;   ///< as in rig.yaml: "cameras.left.distortion"; "body" for the body frame
  std::string text;  ///< what was, and what it is now
};

/// Where the resulting rig differs from the wanted one, in the order of rig.yaml, then what only the resulting one has.
/// Cameras are matched by their role in the pairs, then by name. Camera models are equal if they project equally
/// (models/camera_model.h), numbers if they agree to 12 digits, poses if they agree to 1e-11 m and rad, which is the
/// rounding of a conversion between representations of a rotation.
std::vector<RigDifference> describe_differences(const Rig& wanted, const Rig& result);

}  // namespace spartan
