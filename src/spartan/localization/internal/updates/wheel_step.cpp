#include "spartan/localization/internal/updates/wheel_step.h"

#include <cmath>

#include "spartan/localization/internal/lever_arm.h"

namespace spartan::internal {

std::optional<WheelSample> wheels_at(const WheelMemory& w, Stamp stamp) {
  if (!w.known) return std::nullopt;
  const double apart = seconds_between(w.previous.stamp, w.last.stamp), beyond = seconds_between(w.last.stamp, stamp);
  if (beyond > kFreshWheels_s || beyond > 1.5 * apart) return std::nullopt;
  const double part = apart > 0 ? beyond / apart : 0;
  return WheelSample{stamp, w.last.left_m + part * (w.last.left_m - w.previous.left_m),
                     w.last.right_m + part * (w.last.right_m - w.previous.right_m)};
}

Eigen::Vector3d turning_centre(const LocalizationOptions& options) {
  return LeverArm(options.imu.position_m).from_imu(options.wheels.turning_centre_m);
}

WheelStep step_between(const WheelSample& from, const WheelSample& to, const WheelOdometryOptions& o) {
  const double left = to.left_m - from.left_m, right = to.right_m - from.right_m;
  WheelStep step;
  step.counted_m = 0.5 * (left + right);
  const double distance = std::abs(step.counted_m);
  step.forward_sigma_m = std::hypot(o.min_sigma_m, o.forward_sigma_ratio * distance);
  step.side_sigma_m = std::hypot(o.min_sigma_m, o.side_sigma_ratio * distance);
  step.up_sigma_m = std::hypot(o.min_sigma_m, o.up_sigma_ratio * distance);
  if (o.use_rotation && o.track_m > 0) {
    step.yaw_known = true;
    step.yaw_rad = (right - left) / o.track_m;
    step.yaw_sigma_rad =
        std::hypot(std::sqrt(2.0) * step.forward_sigma_m / o.track_m, o.turn_sigma_ratio * step.yaw_rad);
  }
  return step;
}

void begin_step(FilterMemory& memory, const std::optional<WheelSample>& wheels) {
  StepMemory& step = memory.step;
  step.from = memory.stamp;
  step.odom_from_clone = memory.world_from_odom.inverse() * memory.estimate.state.world_from_body;
  step.has_wheels = wheels.has_value();
  if (wheels) step.wheels = *wheels;
  clone_pose(memory.estimate, error_at::kStepClone);
}

bool still_stationary(FilterMemory& memory, double imu_timeout_s) {
  bool& stationary = memory.step.stationary;
  stationary =
      stationary && memory.inertial_usable() && seconds_between(memory.imu.last.stamp, memory.stamp) <= imu_timeout_s;
  return stationary;
}

}  // namespace spartan::internal
