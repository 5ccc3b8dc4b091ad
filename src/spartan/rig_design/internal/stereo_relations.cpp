#include "spartan/rig_design/internal/stereo_relations.h"

#include <cmath>
#include <limits>

namespace spartan::internal {

double focal_length_px(double width_px, double hfov_rad) {
  return 0.5 * width_px / std::tan(hfov_rad / 2);
}

double focal_length_mm(double pixel_size_um, double width_px, double hfov_rad) {
  return 1e-3 * pixel_size_um * focal_length_px(width_px, hfov_rad);
}

double vertical_view_rad(double hfov_rad, double rows_per_column) {
  return 2 * std::atan(rows_per_column * std::tan(hfov_rad / 2));
}

double range_resolution_m(const StereoGeometry& pair, double disparity_px, double depth_m) {
  return depth_m * depth_m * disparity_px / (focal_length_px(pair.width_px, pair.hfov_rad) * pair.baseline_m);
}

double max_range_m(const StereoGeometry& pair, const DepthAccuracy& accuracy) {
  return std::sqrt(0.5 * accuracy.resolution_m * (pair.baseline_m * pair.width_px) /
                   (accuracy.disparity_px * std::tan(pair.hfov_rad / 2)));
}

double accuracy_for_range_px(const StereoGeometry& pair, double resolution_m, double range_m) {
  return resolution_m * focal_length_px(pair.width_px, pair.hfov_rad) * pair.baseline_m / (range_m * range_m);
}

double width_for_range_px(const StereoGeometry& pair, const DepthAccuracy& accuracy, double range_m) {
  return 2 * accuracy.disparity_px * range_m * range_m * std::tan(pair.hfov_rad / 2) /
         (accuracy.resolution_m * pair.baseline_m);
}

double stereo_angle_rad(double baseline_m, double nearest_m) {
  return 2 * std::atan(baseline_m / (2 * nearest_m));
}

double search_percent(double stereo_angle_rad, double hfov_rad) {
  return 100 * stereo_angle_rad / hfov_rad;
}

double disparity_px(const StereoGeometry& pair, double depth_m) {
  return focal_length_px(pair.width_px, pair.hfov_rad) * pair.baseline_m / depth_m;
}

double ground_ahead_m(double height_m, double depression_rad) {
  if (!(depression_rad > 0)) return std::numeric_limits<double>::infinity();
  return height_m * std::cos(depression_rad) / std::sin(depression_rad);
}

double tilt_to_reach_rad(double height_m, double range_m, double vfov_rad) {
  return std::atan(height_m / range_m) + vfov_rad / 2;
}

double overlap_percent(double hfov_rad, double step_rad) {
  return 100 * (hfov_rad - step_rad) / hfov_rad;
}

}  // namespace spartan::internal
