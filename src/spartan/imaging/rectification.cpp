#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "spartan/imaging/imager.h"
#include "spartan/imaging/internal/virtual_view.h"
#include "spartan/rig/rectified_stereo.h"

namespace spartan {

using namespace internal;

namespace {

// Largest image error in px of cameras that count as rectified; empirical.
constexpr double kTolerance_px = 0.02;
// Larger angles between the optical axes are taken as a calibration mistake; empirical.
constexpr double kMaxAngle_rad = std::numbers::pi / 3;

/// The equivalent pinhole of a camera without distortion and with square pixels; nothing for other cameras.
std::optional<PinholeModel> plain_pinhole(const Camera& camera) {
  PinholeModel pinhole;
  if (const auto* radial = std::get_if<RadialTangentialModel>(&camera.model)) {
    for (const double k : radial->coefficients()) {
      if (k != 0) return std::nullopt;
    }
    pinhole = radial->pinhole();
  } else if (const auto* plain = std::get_if<PinholeModel>(&camera.model)) {
    pinhole = *plain;
  } else {
    return std::nullopt;
  }
  const double aspect_error_px = std::abs(pinhole.fx / pinhole.fy - 1) * camera.size.height;
  return aspect_error_px < kTolerance_px ? std::optional(pinhole) : std::nullopt;
}

/// The geometry of two cameras that are already rectified; nothing for other pairs.
std::optional<RectifiedStereo> rectified_already(const Camera& left, const Camera& right, const Pose& right_from_left) {
  const auto l = plain_pinhole(left), r = plain_pinhole(right);
  if (!l || !r || left.size != right.size) return std::nullopt;
  const double larger_side = std::max(left.size.width, left.size.height);
  const double focal_difference_px = std::abs(l->fx / r->fx - 1) * larger_side;
  const double centre_difference_px = std::hypot(l->cx - r->cx, l->cy - r->cy);
  const double rotation_px = rotation_angle(right_from_left) * std::max(l->fx, larger_side);
  const Eigen::Vector3d right_camera = right_from_left.inverse().translation();
  // A baseline that is off by an angle a shifts rows by a · disparity; disparities are at most about width / 4.
  const double slope = std::hypot(right_camera.y(), right_camera.z()) / right_camera.x();
  const double row_shift_px = slope * left.size.width / 4;
  if (right_camera.x() <= 0 ||
      std::max({focal_difference_px, centre_difference_px, rotation_px, row_shift_px}) >= kTolerance_px) {
    return std::nullopt;
  }
  return RectifiedStereo{left.size, l->fx, {l->cx, l->cy}, right_camera.x()};
}

Status check_baseline(const Eigen::Vector3d& right_camera, const std::string& where) {
  const auto position = fmt::format(
      "the right camera is {:.1f} mm to the right of the left one, {:.1f} mm below and "
      "{:.1f} mm in front of it",
      1e3 * right_camera.x(), 1e3 * right_camera.y(), 1e3 * right_camera.z());
  const double along_x = std::abs(right_camera.x());
  if (!(right_camera.norm() > 0) || !right_camera.allFinite()) {
    return failure(ErrorCode::configuration, "the baseline is zero or not finite", where);
  }
  if (std::abs(right_camera.y()) > along_x) {
    return failure(ErrorCode::configuration, "the baseline is more vertical than horizontal: " + position, where,
                   "vertical stereo pairs are not supported; check the transforms of the two cameras");
  }
  if (std::abs(right_camera.z()) > along_x) {
    return failure(ErrorCode::configuration, "the cameras are behind each other: " + position, where,
                   "check the transforms of the two cameras");
  }
  if (right_camera.x() < 0) {
    return failure(ErrorCode::configuration, "left and right camera are swapped: " + position, where,
                   "exchange left and right of the pair, or invert the transform between the cameras");
  }
  return {};
}

}  // namespace

Result<Rectification> plan_rectification(const Camera& left, const Camera& right, const Pose& right_from_left,
                                         const std::string& where, const VirtualView& view) {
  const Pose left_from_right = right_from_left.inverse();
  const Eigen::Vector3d& right_camera = left_from_right.translation();
  if (Status status = check_baseline(right_camera, where); !status) return failure(status);

  Rectification plan;
  plan.depth_m = effective_depth(view);
  if (const auto geometry = rectified_already(left, right, right_from_left); geometry && !view.is_customized()) {
    plan.geometry = *geometry;
    plan.is_identity = true;
    return plan;
  }

  const Eigen::Vector3d left_axis = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d right_axis = left_from_right.rotation() * Eigen::Vector3d::UnitZ();
  const double apart = std::atan2(left_axis.cross(right_axis).norm(), left_axis.dot(right_axis));
  if (apart > kMaxAngle_rad) {
    return failure(ErrorCode::configuration,
                   fmt::format("the optical axes differ by {:.1f}°, more than 60°", apart * 180 / std::numbers::pi),
                   where, "check the transforms of the two cameras");
  }
  const RectifyingAxes axes = rectifying_axes(right_from_left);
  plan.left_from_rectified = axes.left_from_rectified;
  plan.right_from_rectified = axes.right_from_rectified;

  auto geometry = choose_view({left, plan.left_from_rectified}, {right, plan.right_from_rectified}, view, where);
  if (!geometry) return failure(geometry);
  plan.geometry = *geometry;
  plan.geometry.baseline_m = right_camera.norm();
  return plan;
}

Rectification assume_rectified(const Camera& left, const Pose& right_from_left) {
  Rectification plan;
  plan.is_identity = true;
  plan.geometry.size = left.size;
  plan.geometry.focal_px = resolution_on_axis(left).value_or(1);
  plan.geometry.centre_px = project(left.model, Eigen::Vector3d::UnitZ()).value_or(Eigen::Vector2d::Zero());
  plan.geometry.baseline_m = right_from_left.translation().norm();
  return plan;
}

}  // namespace spartan
