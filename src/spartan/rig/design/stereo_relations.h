// What a stereo pair can do, in closed form. docs/math/rig_design.md derives every relation.
// Source: Kostavelis et al., ICCV Workshops 2011, and the reports on the same rover; the depth error is the textbook's.
#pragma once

namespace spartan {

/// What decides how far a parallel pair measures.
struct StereoShape {
  double baseline_m = 0;
  double width_px = 0;
  double hfov_rad = 0;  ///< horizontal field of view, border to border
};

/// A range resolution that is asked for, and how accurately disparities are known.
struct DepthAccuracy {
  double resolution_m = 0;
  double disparity_px = 0;
};

/// f = w / (2 tan(F/2)), px.
double focal_length_px(double width_px, double hfov_rad);
/// The same length behind pixels of a size in µm, in mm: f = s·10⁻³ · w / (2 tan(F/2)).
double focal_length_mm(double pixel_size_um, double width_px, double hfov_rad);
/// Square pixels: tan(V/2) = rows/columns · tan(F/2).
double vertical_view_rad(double hfov_rad, double rows_per_column);

/// Δz = z² c / (f b): what a disparity step of c is worth at depth z, m.
double range_resolution_m(const StereoShape& shape, double disparity_px, double depth_m);
/// The depth where that is worth r: l = sqrt(r b w / (2 c tan(F/2))), m.
double reach_m(const StereoShape& shape, const DepthAccuracy& accuracy);
/// The disparity accuracy with which a shape reaches a range: c = r f b / l², px.
double accuracy_for_reach_px(const StereoShape& shape, double resolution_m, double range_m);
/// The width with which it does: w = 2 c l² tan(F/2) / (r b), px. `shape.width_px` does not count.
double width_for_reach_px(const StereoShape& shape, const DepthAccuracy& accuracy, double range_m);

/// The angle between both eyes' lines of sight to a point straight ahead: φ = 2 atan(b / 2d), rad.
double stereo_angle_rad(double baseline_m, double nearest_m);
/// The part of the image's width over which a match is looked for: 100 φ / F, percent.
double search_percent(double stereo_angle_rad, double hfov_rad);
/// f b / z, px.
double disparity_px(const StereoShape& shape, double depth_m);

/// How far ahead of a camera's foot level ground is met by a line of sight that looks down by so much: h / tan(a), m.
/// Negative behind nadir (a > 90°); infinite at the horizon and above.
double ground_ahead_m(double height_m, double depression_rad);
/// The tilt with which the top row meets the ground at that distance: atan(h / l) + V/2, rad.
double tilt_to_reach_rad(double height_m, double range_m, double vfov_rad);
/// What two views share that are turned by `step` against each other: 100 (F − step) / F, percent; negative: a gap.
double overlap_percent(double hfov_rad, double step_rad);

}  // namespace spartan
