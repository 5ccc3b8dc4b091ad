#include "spartan/imaging/rectification.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "spartan/rig/rectifying_axes.h"

namespace spartan {
namespace {

constexpr double kTolerance_px = 0.02;  // of images that count as rectified
constexpr double kLargestAngle_rad = std::numbers::pi / 3;

/// The pinhole a camera is, where it has no distortion and square pixels.
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
  const double skew_px = std::abs(pinhole.fx / pinhole.fy - 1) * camera.size.height;
  return skew_px < kTolerance_px ? std::optional(pinhole) : std::nullopt;
}

/// The geometry of two cameras that need no rectification.
std::optional<RectifiedStereo> rectified_already(const Camera& left, const Camera& right, const Pose& right_from_left) {
  const auto l = plain_pinhole(left), r = plain_pinhole(right);
  if (!l || !r || left.size != right.size) return std::nullopt;
  const double larger_side = std::max(left.size.width, left.size.height);
  const double focal_difference_px = std::abs(l->fx / r->fx - 1) * larger_side;
  const double centre_difference_px = std::hypot(l->cx - r->cx, l->cy - r->cy);
  const double turn_px = rotation_angle(right_from_left) * std::max(l->fx, larger_side);
  const Eigen::Vector3d right_eye = right_from_left.inverse().translation();
  // A baseline off by the angle a shifts rows by a · disparity; a quarter of the width is as large as those get.
  const double slope = std::hypot(right_eye.y(), right_eye.z()) / right_eye.x();
  const double row_shift_px = slope * left.size.width / 4;
  if (right_eye.x() <= 0 ||
      std::max({focal_difference_px, centre_difference_px, turn_px, row_shift_px}) >= kTolerance_px) {
    return std::nullopt;
  }
  return RectifiedStereo{left.size, l->fx, {l->cx, l->cy}, right_eye.x()};
}

Status check_baseline(const Eigen::Vector3d& right_eye, const std::string& where) {
  const auto place = fmt::format(
      "the right eye stands {:.1f} mm to the right of the left one, {:.1f} mm below and "
      "{:.1f} mm before it",
      1e3 * right_eye.x(), 1e3 * right_eye.y(), 1e3 * right_eye.z());
  const double along_x = std::abs(right_eye.x());
  if (!(right_eye.norm() > 0) || !right_eye.allFinite()) {
    return failure(ErrorCode::configuration, "the baseline is zero or not finite", where);
  }
  if (std::abs(right_eye.y()) > along_x) {
    return failure(ErrorCode::configuration, "the baseline is more vertical than horizontal: " + place, where,
                   "eyes above each other are not supported; check the transforms of the two cameras");
  }
  if (std::abs(right_eye.z()) > along_x) {
    return failure(ErrorCode::configuration, "the eyes stand behind each other: " + place, where,
                   "check the transforms of the two cameras");
  }
  if (right_eye.x() < 0) {
    return failure(ErrorCode::configuration, "the eyes are swapped: " + place, where,
                   "exchange left and right of the pair, or invert the transform if it was given the wrong way round");
  }
  return {};
}

}  // namespace

Result<Rectification> plan_rectification(const Camera& left, const Camera& right, const Pose& right_from_left,
                                         const std::string& where, const VirtualView& view) {
  const Pose left_from_right = right_from_left.inverse();
  const Eigen::Vector3d& right_eye = left_from_right.translation();
  if (Status status = check_baseline(right_eye, where); !status) return failure(status);

  Rectification plan;
  plan.depth_m = depth_of(view);
  if (const auto geometry = rectified_already(left, right, right_from_left); geometry && !view.is_chosen()) {
    plan.geometry = *geometry;
    plan.passes_through = true;
    return plan;
  }

  const Eigen::Vector3d left_axis = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d right_axis = left_from_right.rotation() * Eigen::Vector3d::UnitZ();
  const double apart = std::atan2(left_axis.cross(right_axis).norm(), left_axis.dot(right_axis));
  if (apart > kLargestAngle_rad) {
    return failure(
        ErrorCode::configuration,
        fmt::format("the eyes look apart: their axes are {:.1f}° from each other", apart * 180 / std::numbers::pi),
        where, "check the transforms of the two cameras");
  }
  const RectifyingAxes axes = rectifying_axes(right_from_left);
  plan.left_from_rectified = axes.left_from_rectified;
  plan.right_from_rectified = axes.right_from_rectified;

  auto geometry = choose_view({left, plan.left_from_rectified}, {right, plan.right_from_rectified}, view, where);
  if (!geometry) return failure(geometry);
  plan.geometry = *geometry;
  plan.geometry.baseline_m = right_eye.norm();
  return plan;
}

Rectification assume_rectified(const Camera& left, const Pose& right_from_left) {
  Rectification plan;
  plan.passes_through = true;
  plan.geometry.size = left.size;
  plan.geometry.focal_px = resolution_on_axis(left).value_or(1);
  plan.geometry.centre_px = project(left.model, Eigen::Vector3d::UnitZ()).value_or(Eigen::Vector2d::Zero());
  plan.geometry.baseline_m = right_from_left.translation().norm();
  return plan;
}

}  // namespace spartan
