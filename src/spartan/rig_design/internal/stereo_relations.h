// Closed-form relations between the geometry and the performance of a stereo pair, derived in docs/math/rig_design.md.
// Source: Kostavelis et al., ICCV Workshops 2011, and the reports on the same rover; the depth error is the standard
// one.
#pragma once

namespace spartan::internal {

/// The parameters of a parallel pair that determine its range resolution.
struct StereoGeometry {
  double baseline_m = 0;
  double width_px = 0;
  double hfov_rad = 0;  ///< horizontal field of view, from border to border
};

/// A required range resolution, and the accuracy of disparities.
struct DepthAccuracy {
  double resolution_m = 0;
  double disparity_px = 0;
};

/// Focal length f = w / (2 tan(F/2)), px.
double focal_length_px(double width_px, double hfov_rad);
/// The same in mm, for pixels of `pixel_size_um`: f = s·10⁻³ · w / (2 tan(F/2)).
double focal_length_mm(double pixel_size_um, double width_px, double hfov_rad);
/// Vertical field of view of square pixels: tan(V/2) = rows/columns · tan(F/2), rad.
double vertical_view_rad(double hfov_rad, double rows_per_column);

/// Range resolution Δz = z² c / (f b): the depth change of a disparity step c at depth z, m.
double range_resolution_m(const StereoGeometry& pair, double disparity_px, double depth_m);
/// The depth at which the range resolution is r: l = sqrt(r b w / (2 c tan(F/2))), m.
double max_range_m(const StereoGeometry& pair, const DepthAccuracy& accuracy);
/// The disparity accuracy that the resolution requires at a range: c = r f b / l², px.
double accuracy_for_range_px(const StereoGeometry& pair, double resolution_m, double range_m);
/// The image width that it requires at a range: w = 2 c l² tan(F/2) / (r b), px. `pair.width_px` is ignored.
double width_for_range_px(const StereoGeometry& pair, const DepthAccuracy& accuracy, double range_m);

/// Stereo (convergence) angle: the angle between the rays of both cameras to a point straight ahead at distance d,
/// φ = 2 atan(b / 2d), rad.
double stereo_angle_rad(double baseline_m, double nearest_m);
/// Disparity search range as a share of the image width: 100 φ / F, percent.
double search_percent(double stereo_angle_rad, double hfov_rad);
/// Disparity f b / z, px.
double disparity_px(const StereoGeometry& pair, double depth_m);

/// Distance ahead of the foot of a camera at which a ray with depression a meets level ground: h / tan(a), m. Negative
/// beyond the nadir (a > 90°); infinite at the horizon and above.
double ground_ahead_m(double height_m, double depression_rad);
/// The tilt at which the top row meets the ground at a range: atan(h / l) + V/2, rad.
double tilt_to_reach_rad(double height_m, double range_m, double vfov_rad);
/// Overlap of two views that are rotated by `step` relative to each other: 100 (F − step) / F, percent; negative: a
/// gap.
double overlap_percent(double hfov_rad, double step_rad);

}  // namespace spartan::internal
