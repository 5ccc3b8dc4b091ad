#include "spartan/rig/describe.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "spartan/rig/rig_findings.h"

namespace spartan {
namespace {

constexpr double kDegreesPerRadian = 180 / std::numbers::pi;
constexpr double kDisparityStep_px = 0.3;
constexpr std::array<double, 6> kRanges_m{0.5, 1, 2, 5, 10, 20};
// What is smaller than this is not worth a word.
constexpr double kLeastLength_m = 0.5e-6, kLeastAngle_deg = 0.0005;
// "120.0 mm", and metres above one of them.
// "0.020°": angles of a calibration are small, those of a mast are not.
std::string angle(double degrees) {
  return std::abs(degrees) < 1 ? fmt::format("{:.3f}°", degrees) : fmt::format("{:.2f}°", degrees);
}

void add_part(std::vector<std::string>& parts, double value, double least, const std::string& text, const char* above,
              const char* below) {
  if (std::abs(value) >= least) parts.push_back(fmt::format("{} {}", text, value > 0 ? above : below));
}

std::string joined(const std::vector<std::string>& parts, const char* none) {
  return parts.empty() ? none : fmt::format("{}", fmt::join(parts, ", "));
}

// Turns of an optical frame, R = Ry(right) Rx(up) Rz(clockwise): first to the side, then up, then about its own axis.
struct Turns {
  double right_deg, up_deg, clockwise_deg;
};
Turns turns_of(const Eigen::Matrix3d& r) {
  return {std::atan2(r(0, 2), r(2, 2)) * kDegreesPerRadian,
          std::asin(std::clamp(-r(1, 2), -1.0, 1.0)) * kDegreesPerRadian,
          std::atan2(r(1, 0), r(1, 1)) * kDegreesPerRadian};
}

// The angle between the lines of sight of two places of the picture; NaN where the model does not see one.
double view_deg(const CameraModel& model, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const auto a = unproject(model, from), b = unproject(model, to);
  if (!a || !b) return std::numeric_limits<double>::quiet_NaN();
  return std::atan2(a->direction.cross(b->direction).norm(), a->direction.dot(b->direction)) * kDegreesPerRadian;
}

// From border to border of the picture, through the middle of it.
double horizontal_view_deg(const Camera& c) {
  const double middle = 0.5 * (c.size.height - 1);
  return view_deg(c.model, {-0.5, middle}, {c.size.width - 0.5, middle});
}
double vertical_view_deg(const Camera& c) {
  const double middle = 0.5 * (c.size.width - 1);
  return view_deg(c.model, {middle, -0.5}, {middle, c.size.height - 0.5});
}

// Pixels per radian across the middle of the view.
double focal_px(const Camera& camera) {
  const auto ahead = project_with_jacobian(camera.model, Eigen::Vector3d::UnitZ());
  return ahead ? ahead->by_point(0, 0) : std::numeric_limits<double>::quiet_NaN();
}

std::string describe_place(const Rig& rig, const Camera& camera) {
  const Pose body_from_camera = rig.body_from_camera(camera.name);
  const Eigen::Vector3d& t = body_from_camera.translation();
  const Eigen::Vector3d look = body_from_camera.rotation() * Eigen::Vector3d::UnitZ();
  std::vector<std::string> place, turn;
  add_part(place, t.x(), kLeastLength_m, describe_length(std::abs(t.x())), "ahead", "behind");
  add_part(place, t.y(), kLeastLength_m, describe_length(std::abs(t.y())), "to the left", "to the right");
  add_part(place, t.z(), kLeastLength_m, describe_length(std::abs(t.z())), "above", "below");
  const double side = std::atan2(look.y(), look.x()) * kDegreesPerRadian;
  const double down = std::asin(std::clamp(-look.z(), -1.0, 1.0)) * kDegreesPerRadian;
  add_part(turn, side, kLeastAngle_deg, angle(std::abs(side)), "to the left", "to the right");
  add_part(turn, down, kLeastAngle_deg, angle(std::abs(down)), "down", "up");
  std::string text =
      fmt::format("in the body's frame {}; looks {}", joined(place, "at the origin"), joined(turn, "straight ahead"));
  if (camera.mount != "body") text += fmt::format(" (on '{}', at its angles of rest)", camera.mount);
  return text;
}

std::string describe_camera(const Rig& rig, const Camera& c) {
  std::string pixels{name_of(c.pixel_format.layout)};
  if (c.pixel_format.bits != 8) pixels += fmt::format(" of {} bits", c.pixel_format.bits);
  if (!c.vignetting.coefficients.empty()) pixels += ", with vignetting";
  if (!c.self_mask.empty()) pixels += ", with a self-mask";
  return fmt::format("camera {}: {}, {} x {} px, {}; view {:.2f}° x {:.2f}°, {:.1f} px per radian in the middle; {}",
                     c.name, name_of(c.model), c.size.width, c.size.height, pixels, horizontal_view_deg(c),
                     vertical_view_deg(c), focal_px(c), describe_place(rig, c));
}

void describe_pair(const Rig& rig, const StereoPair& pair, std::vector<std::string>& sentences) {
  const PairSummary summary = summarize_pair(rig, pair);
  const Pose left_from_right = rig.right_from_left(pair).inverse();
  sentences.push_back(fmt::format("pair {}: baseline {}; seen from the left camera, the right one is {}", pair.name,
                                  describe_length(summary.baseline_m), describe_relative_pose(left_from_right)));
  std::vector<std::string> table;
  for (const double z : kRanges_m) {
    const double step_m = z * z * kDisparityStep_px / (summary.focal_px * summary.baseline_m);
    table.push_back(fmt::format("{} at {:g} m", describe_length(step_m), z));
  }
  sentences.push_back(
      fmt::format("pair {}: {:g} px of disparity are {}", pair.name, kDisparityStep_px, fmt::join(table, ", ")));
  if (pair.nearest_m > 0) {
    sentences.push_back(fmt::format("pair {}: nothing nearer than {:g} m has to be matched: {:.0f} px of disparity",
                                    pair.name, pair.nearest_m, summary.focal_px * summary.baseline_m / pair.nearest_m));
  }
  if (!pair.for_odometry) sentences.push_back(fmt::format("pair {}: not for the odometry", pair.name));
}

}  // namespace

std::vector<std::string> describe_doubts(const Rig& rig, const StereoPair& pair) {
  std::vector<std::string> sentences;
  for (const RigFinding& doubt : find_doubts(rig, pair))
    sentences.push_back(fmt::format("pair {}: DOUBT ({}): {}", pair.name, doubt.id, doubt.text));
  return sentences;
}

std::string describe_length(double metres) {
  return metres < 1 ? fmt::format("{:.1f} mm", 1000 * metres) : fmt::format("{:.3f} m", metres);
}

std::string describe_relative_pose(const Pose& first_from_second) {
  const Eigen::Vector3d& t = first_from_second.translation();
  std::vector<std::string> place, turn;
  add_part(place, t.x(), kLeastLength_m, describe_length(std::abs(t.x())), "to the right", "to the left");
  add_part(place, t.y(), kLeastLength_m, describe_length(std::abs(t.y())), "down", "up");
  add_part(place, t.z(), kLeastLength_m, describe_length(std::abs(t.z())), "ahead", "back");
  const Turns turns = turns_of(first_from_second.rotation().toRotationMatrix());
  add_part(turn, turns.right_deg, kLeastAngle_deg, angle(std::abs(turns.right_deg)), "to the right", "to the left");
  add_part(turn, turns.up_deg, kLeastAngle_deg, angle(std::abs(turns.up_deg)), "up", "down");
  add_part(turn, turns.clockwise_deg, kLeastAngle_deg, angle(std::abs(turns.clockwise_deg)), "clockwise",
           "counter-clockwise");
  return fmt::format("{}; {}", joined(place, "at the same place"),
                     turn.empty() ? "not turned" : fmt::format("turned {}", fmt::join(turn, ", ")));
}

PairSummary summarize_pair(const Rig& rig, const StereoPair& pair) {
  const Camera& left = *rig.find_camera(pair.left);
  return {pair.name, rig.right_from_left(pair).translation().norm(), focal_px(left), horizontal_view_deg(left),
          vertical_view_deg(left)};
}

std::vector<std::string> describe_rig(const Rig& rig) {
  std::vector<std::string> sentences{
      fmt::format("rig {}: {} cameras, {} stereo pair{}; poses are those of {}", rig.name, rig.cameras.size(),
                  rig.pairs.size(), rig.pairs.size() == 1 ? "" : "s",
                  rig.convention == PoseConvention::body ? "the body" : "the left camera, from where it began")};
  for (const PanTiltUnit& unit : rig.pan_tilt_units) {
    const Eigen::Vector3d& t = unit.body_from_base.translation();
    sentences.push_back(fmt::format(
        "pan-tilt unit {}: {:.3f} m ahead, {:.3f} m to the left, {:.3f} m above the body's origin; at rest {} to the "
        "left, {} down",
        unit.name, t.x(), t.y(), t.z(), angle(unit.rest_pan_rad * kDegreesPerRadian),
        angle(unit.rest_tilt_rad * kDegreesPerRadian)));
  }
  for (const Camera& camera : rig.cameras) sentences.push_back(describe_camera(rig, camera));
  for (const StereoPair& pair : rig.pairs) describe_pair(rig, pair, sentences);
  return sentences;
}

}  // namespace spartan
