// The localization filter: processes measurements one by one in the order of time.
//
// An error-state Kalman filter (Solà 2017) with stochastic cloning (Roumeliotis & Burdick 2002) for relative motions
// between two times. docs/math/localization.md has the formulas.
#pragma once

#include <optional>
#include <span>

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/lever_arm.h"
#include "spartan/localization/internal/past_state.h"
#include "spartan/localization/internal/updates/compass_update.h"
#include "spartan/localization/internal/updates/imu_update.h"
#include "spartan/localization/internal/updates/inclinometer_update.h"
#include "spartan/localization/internal/updates/map_update.h"
#include "spartan/localization/internal/updates/motion_update.h"
#include "spartan/localization/internal/updates/vision_drift.h"
#include "spartan/localization/internal/updates/wheel_update.h"
#include "spartan/localization/localization_options.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {

/// One memory, and an object for each sensor that updates it.
class ErrorStateFilter {
 public:
  explicit ErrorStateFilter(const LocalizationOptions& options);

  /// Initializes the filter at the origin of the world, whose axes follow from static alignment by the samples `before`
  /// (up to `stamp`, in order of time; motions and constraints among them are ignored).
  void start(Stamp stamp, const Eigen::Vector3d& ahead_in_body, std::span<const Measurement> before,
             const std::optional<Eigen::Vector3d>& up_in_body = {},
             const Eigen::Vector3d& assumed_up_in_body = Eigen::Vector3d::UnitZ());

  /// Measurements must be processed in the order of comes_before(), but those of the IMU by
  /// InertialOptions::max_time_error_s before their stamps.
  void process(const Measurement& measurement);

  /// Propagates to a time that is not earlier than that of the memory.
  void predict_to(Stamp stamp) { imu_.advance_to(memory_, stamp); }

  const FilterMemory& memory() const { return memory_; }
  void set_memory(const FilterMemory& memory) { memory_ = memory; }

  /// From now on the state of this time is kept up beside the present one (memory().estimate.past).
  void begin_past() { internal::begin_past(memory_.estimate); }

  UncertainPose world_from_body() const { return body_pose(memory_.estimate); }
  /// world_from_body of an estimate of this filter.
  UncertainPose body_pose(const StateEstimate& estimate) const;
  /// With the covariance accumulated since the start.
  UncertainPose odom_from_body() const;
  /// Of the body's origin, world.
  Eigen::Vector3d velocity() const;

 private:
  void update(const ImuSample& sample) { imu_.add(memory_, sample); }
  void update(const RelativeMotion& motion) { motions_.update(memory_, motion); }
  void update(const WheelSample& sample) { wheels_.update(memory_, sample); }
  void update(const CompassSample& sample) { compass_.update(memory_, sample); }
  void update(const InclinometerSample& sample) { inclinometer_.update(memory_, sample); }
  void update(const PoseConstraint& constraint) { map_.update(memory_, constraint); }
  void update(const LateConstraint& constraint) { map_.update(memory_, constraint); }

  LocalizationOptions options_;
  LeverArm arm_;
  VisionDrift drift_;
  ImuUpdate imu_;
  MotionUpdate motions_;
  WheelUpdate wheels_;
  CompassUpdate compass_;
  InclinometerUpdate inclinometer_;
  MapUpdate map_;
  FilterMemory memory_;
};

}  // namespace spartan::internal
