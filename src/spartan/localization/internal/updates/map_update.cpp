#include "spartan/localization/internal/updates/map_update.h"

#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/updates/filter_correction.h"

namespace spartan::internal {

void MapUpdate::update(FilterMemory& memory, const PoseConstraint& constraint) const {
  apply(memory, constraint, error_at::kPose);
}

void MapUpdate::update(FilterMemory& memory, const LateConstraint& constraint) const {
  if (constraint.at_frame.stamp == memory.vision.clone_stamp)
    apply(memory, constraint.at_frame, error_at::kVisionClone);
}

void MapUpdate::apply(FilterMemory& memory, const PoseConstraint& of_body, int pose) const {
  const PoseConstraint constraint = arm_.imu_constraint(of_body);
  const Innovation innovation = map_innovation(memory.estimate, pose, constraint, covariance_factor_);
  if (innovation.rows() == 0) return;
  const double nis = normalized_innovation_squared(memory.estimate.covariance, innovation);
  if (gates_.accept(memory, LocalizationSensor::map, nis, innovation.rows(), HealthReason::disagrees))
    correct_by_map(memory, innovation);
}

}  // namespace spartan::internal
