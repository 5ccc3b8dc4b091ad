#include "spartan/localization/internal/updates/filter_correction.h"

#include "spartan/localization/internal/measurement_models.h"

namespace spartan::internal {
namespace {

void preserve_odom(FilterMemory& memory, const Pose& world_from_body_before) {
  memory.world_from_odom =
      memory.estimate.state.world_from_body * world_from_body_before.inverse() * memory.world_from_odom;
}

}  // namespace

void correct_world(FilterMemory& memory, const Innovation& innovation) {
  const Pose before = memory.estimate.state.world_from_body;
  if (correct(memory.estimate, innovation)) preserve_odom(memory, before);
}

void correct_by_map(FilterMemory& memory, const Innovation& innovation) {
  const Pose before = memory.estimate.state.world_from_body;
  constexpr int kDrift = error_at::kVisionDrift, kCount = error_at::kVisionClone - error_at::kVisionDrift;
  if (correct_all_but(memory.estimate, innovation, kDrift, kCount)) preserve_odom(memory, before);
}

void correct_motion(FilterMemory& memory, const Innovation& innovation, int clone) {
  if (correct(memory.estimate, innovation)) set_odom_by_motion(memory, clone);
}

void correct_prediction(FilterMemory& memory, const Innovation& innovation) {
  constexpr int kFirst = error_at::kGyroBias;
  if (correct_all_but(memory.estimate, innovation, kFirst, error_at::kSize - kFirst))
    set_odom_by_motion(memory, error_at::kStepClone);
}

void set_odom_by_motion(FilterMemory& memory, int clone) {
  const NavigationState& s = memory.estimate.state;
  const Pose odom_from_body =
      (clone == error_at::kVisionClone ? memory.vision.odom_from_clone : memory.step.odom_from_clone) *
      motion_since_clone(s, clone).clone_from_body;
  memory.world_from_odom = s.world_from_body * odom_from_body.inverse();
}

UncertainPose odom_from_imu(const FilterMemory& memory) {
  const MotionSinceClone motion = motion_since_clone(memory.estimate.state, error_at::kVisionClone);
  const Matrix6d covariance = motion.jacobian * memory.estimate.covariance * motion.jacobian.transpose();
  const Pose odom_from_body = memory.world_from_odom.inverse() * memory.estimate.state.world_from_body;
  UncertainPose odom =
      compose({memory.vision.odom_from_clone, memory.vision.odom_covariance}, {motion.clone_from_body, covariance});
  odom.pose = odom_from_body;
  return odom;
}

}  // namespace spartan::internal
