#include "spartan/rig/describe.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "spartan/core/pose.h"

namespace spartan {
namespace {

constexpr double kDisparityStep_px = 0.3;
constexpr std::array<double, 6> kRanges_m{0.5, 1, 2, 5, 10, 20};
// Smaller components are omitted.
constexpr double kMinLength_m = 0.5e-6, kMinAngle_deg = 0.0005;

// "0.020°" below one degree, as in a calibration; "39.00°" above, as of a mast.
std::string angle(double degrees) {
  return std::abs(degrees) < 1 ? fmt::format("{:.3f}°", degrees) : fmt::format("{:.2f}°", degrees);
}

void add_part(std::vector<std::string>& parts, double value, double least, const std::string& text,
              const char* positive, const char* negative) {
  if (std::abs(value) >= least) parts.push_back(fmt::format("{} {}", text, value > 0 ? positive : negative));
}

std::string joined(const std::vector<std::string>& parts, const char* none) {
  return parts.empty() ? none : fmt::format("{}", fmt::join(parts, ", "));
}

// Euler angles of an optical frame, R = Ry(right) Rx(up) Rz(clockwise): yaw, then pitch, then roll about its own axis.
struct EulerAngles {
  double right_deg, up_deg, clockwise_deg;
};
EulerAngles euler_angles(const Eigen::Matrix3d& r) {
  return {std::atan2(r(0, 2), r(2, 2)) * kDegreesPerRadian,
          std::asin(std::clamp(-r(1, 2), -1.0, 1.0)) * kDegreesPerRadian,
          std::atan2(r(1, 0), r(1, 1)) * kDegreesPerRadian};
}

// The angle between the rays of two pixels; NaN where the model cannot unproject one.
double angle_between_deg(const CameraModel& model, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const auto a = unproject(model, from), b = unproject(model, to);
  if (!a || !b) return std::numeric_limits<double>::quiet_NaN();
  return std::atan2(a->direction.cross(b->direction).norm(), a->direction.dot(b->direction)) * kDegreesPerRadian;
}

// Fields of view from border to border, through the image centre.
double horizontal_view_deg(const Camera& c) {
  const double middle = 0.5 * (c.size.height - 1);
  return angle_between_deg(c.model, {-0.5, middle}, {c.size.width - 0.5, middle});
}
double vertical_view_deg(const Camera& c) {
  const double middle = 0.5 * (c.size.width - 1);
  return angle_between_deg(c.model, {middle, -0.5}, {middle, c.size.height - 0.5});
}

// Horizontal pixels per radian on the optical axis.
double focal_px(const Camera& camera) {
  const auto ahead = project_with_jacobian(camera.model, Eigen::Vector3d::UnitZ());
  return ahead ? ahead->by_point(0, 0) : std::numeric_limits<double>::quiet_NaN();
}

std::string describe_pose(const Rig& rig, const Camera& camera) {
  const Pose body_from_camera = rig.body_from_camera(camera.name);
  const Eigen::Vector3d& t = body_from_camera.translation();
  const Eigen::Vector3d axis = body_from_camera.rotation() * Eigen::Vector3d::UnitZ();
  std::vector<std::string> position, rotation;
  add_part(position, t.x(), kMinLength_m, describe_length(std::abs(t.x())), "ahead", "behind");
  add_part(position, t.y(), kMinLength_m, describe_length(std::abs(t.y())), "to the left", "to the right");
  add_part(position, t.z(), kMinLength_m, describe_length(std::abs(t.z())), "above", "below");
  const double side = std::atan2(axis.y(), axis.x()) * kDegreesPerRadian;
  const double down = std::asin(std::clamp(-axis.z(), -1.0, 1.0)) * kDegreesPerRadian;
  add_part(rotation, side, kMinAngle_deg, angle(std::abs(side)), "to the left", "to the right");
  add_part(rotation, down, kMinAngle_deg, angle(std::abs(down)), "down", "up");
  std::string text = fmt::format("in the body frame {}; optical axis {}", joined(position, "at the origin"),
                                 joined(rotation, "straight ahead"));
  if (camera.mount != "body") text += fmt::format(" (on '{}', at its rest angles)", camera.mount);
  return text;
}

std::string describe_camera(const Rig& rig, const Camera& c) {
  std::string pixels{name_of(c.pixel_format.layout)};
  if (c.pixel_format.bits != 8) pixels += fmt::format(" with {} bits", c.pixel_format.bits);
  if (!c.vignetting.coefficients.empty()) pixels += ", with vignetting";
  if (!c.self_mask.empty()) pixels += ", with a self-mask";
  return fmt::format(
      "camera {}: {}, {} x {} px, {}; field of view {:.2f}° x {:.2f}°, focal length {:.1f} px on the optical axis; {}",
      c.name, name_of(c.model), c.size.width, c.size.height, pixels, horizontal_view_deg(c), vertical_view_deg(c),
      focal_px(c), describe_pose(rig, c));
}

void describe_pair(const Rig& rig, const StereoPair& pair, std::vector<std::string>& lines) {
  const PairSummary summary = summarize_pair(rig, pair);
  const Pose left_from_right = rig.right_from_left(pair).inverse();
  lines.push_back(fmt::format("pair {}: baseline {}; relative to the left camera, the right one is {}", pair.name,
                              describe_length(summary.baseline_m), describe_relative_pose(left_from_right)));
  std::vector<std::string> table;
  for (const double z : kRanges_m) {
    const double step_m = z * z * kDisparityStep_px / (summary.focal_px * summary.baseline_m);
    table.push_back(fmt::format("{} at {:g} m", describe_length(step_m), z));
  }
  lines.push_back(fmt::format("pair {}: range resolution for {:g} px of disparity: {}", pair.name, kDisparityStep_px,
                              fmt::join(table, ", ")));
  if (pair.nearest_m > 0) {
    lines.push_back(fmt::format("pair {}: nearest depth to match {:g} m: {:.0f} px of disparity", pair.name,
                                pair.nearest_m, summary.focal_px * summary.baseline_m / pair.nearest_m));
  }
  if (!pair.for_odometry) lines.push_back(fmt::format("pair {}: not used for odometry", pair.name));
}

}  // namespace

std::vector<std::string> describe_plausibility(const Rig& rig, const StereoPair& pair) {
  std::vector<std::string> lines;
  for (const RigFinding& finding : plausibility_findings(rig, pair))
    lines.push_back(fmt::format("pair {}: SUSPICIOUS ({}): {}", pair.name, finding.id, finding.text));
  return lines;
}

std::string describe_length(double metres) {
  return metres < 1 ? fmt::format("{:.1f} mm", 1000 * metres) : fmt::format("{:.3f} m", metres);
}

std::string describe_relative_pose(const Pose& first_from_second) {
  const Eigen::Vector3d& t = first_from_second.translation();
  std::vector<std::string> position, rotation;
  add_part(position, t.x(), kMinLength_m, describe_length(std::abs(t.x())), "to the right", "to the left");
  add_part(position, t.y(), kMinLength_m, describe_length(std::abs(t.y())), "down", "up");
  add_part(position, t.z(), kMinLength_m, describe_length(std::abs(t.z())), "ahead", "back");
  const EulerAngles angles = euler_angles(first_from_second.rotation().toRotationMatrix());
  add_part(rotation, angles.right_deg, kMinAngle_deg, angle(std::abs(angles.right_deg)), "to the right", "to the left");
  add_part(rotation, angles.up_deg, kMinAngle_deg, angle(std::abs(angles.up_deg)), "up", "down");
  add_part(rotation, angles.clockwise_deg, kMinAngle_deg, angle(std::abs(angles.clockwise_deg)), "clockwise",
           "counter-clockwise");
  return fmt::format("{}; {}", joined(position, "at the same position"),
                     rotation.empty() ? "not rotated" : fmt::format("rotated {}", fmt::join(rotation, ", ")));
}

PairSummary summarize_pair(const Rig& rig, const StereoPair& pair) {
  const Camera& left = *rig.find_camera(pair.left);
  return {pair.name, rig.right_from_left(pair).translation().norm(), focal_px(left), horizontal_view_deg(left),
          vertical_view_deg(left)};
}

std::vector<std::string> describe_rig(const Rig& rig) {
  std::vector<std::string> lines{
      fmt::format("rig {}: {} cameras, {} stereo pair{}; poses of recordings with this rig are those of {}", rig.name,
                  rig.cameras.size(), rig.pairs.size(), rig.pairs.size() == 1 ? "" : "s",
                  rig.convention == PoseConvention::body ? "the body" : "the left camera, relative to its first pose")};
  for (const PanTiltUnit& unit : rig.pan_tilt_units) {
    const Eigen::Vector3d& t = unit.body_from_base.translation();
    lines.push_back(fmt::format(
        "pan-tilt unit {}: {:.3f} m ahead, {:.3f} m to the left, {:.3f} m above the body origin; at rest {} to the "
        "left, {} down",
        unit.name, t.x(), t.y(), t.z(), angle(unit.rest_pan_rad * kDegreesPerRadian),
        angle(unit.rest_tilt_rad * kDegreesPerRadian)));
  }
  for (const Camera& camera : rig.cameras) lines.push_back(describe_camera(rig, camera));
  for (const StereoPair& pair : rig.pairs) describe_pair(rig, pair, lines);
  return lines;
}

}  // namespace spartan
