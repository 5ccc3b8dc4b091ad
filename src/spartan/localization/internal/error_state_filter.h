// The localization filter: processes measurements one by one in the order of time.
//
// An error-state Kalman filter (Solà 2017) with stochastic cloning (Roumeliotis & Burdick 2002) for relative motions
// between two times. docs/math/localization.md has the formulas.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/lever_arm.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/motion_decision.h"
#include "spartan/localization/internal/past_state.h"
#include "spartan/localization/internal/propagation.h"
#include "spartan/localization/localization_options.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {

/// A visual motion of the IMU, and how the errors that last act on it.
struct VisualMotion {
  RelativeMotion motion;
  MotionErrors errors;
};

/// Whether a reading is in the physical range of a rover.
bool is_possible(const ImuSample& sample);

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
  void predict_to(Stamp stamp) { advance_to(stamp); }

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
  UncertainPose odom_from_imu() const;

  // Propagation: error_state_filter.cpp.
  void advance_to(Stamp stamp);
  void propagate_to(Stamp stamp, const ImuSample* next);
  void propagate_inertially(double seconds, const ImuSample& from, const ImuSample& to);
  void propagate_at_constant_velocity(double seconds);
  void propagate_biases(double seconds);
  bool inertial_usable() const;

  // IMU: imu_update.cpp.
  void update(const ImuSample& by_own_clock);
  void use_waiting_until(Stamp stamp);
  ImuSample at_frame_time(const ImuSample& by_own_clock) const;
  void use(const ImuSample& sample);
  void check_reading(const ImuSample& sample);
  void level(const ImuSample& sample);
  void search_alignment(const ImuSample& sample);
  AlignmentPrior alignment_prior() const;
  void align(const InertialAlignment& alignment);
  void detect_stationary(const ImuSample& sample);

  // Visual motions between frames: motion_update.cpp.
  void update(const RelativeMotion& of_body);
  VisualMotion of_imu(const RelativeMotion& motion) const;
  bool update_by_motion(const VisualMotion& visual);
  void propagate_drift(int index, const Vector6d& sigmas, double steps);
  void inflate_prediction(const Innovation& innovation, const RelativeMotion& motion);
  void reset_prediction(const Innovation& innovation, double nis, const RelativeMotion& motion);
  bool accept_vision(const MotionDecision& decision);
  void count_agreement_of_imu(bool velocity_was_reset);
  void follow_vision(const VisualMotion& visual, const Matrix6d& covariance);
  void accept_doubted_motion();
  void begin_frame(Stamp stamp);

  // What other sensors say about a visual motion: motion_evidence.cpp.
  MotionEvidence evidence_of(const VisualMotion& visual, const Innovation& innovation) const;
  bool is_implausible(const RelativeMotion& motion) const;
  void remember_motion(const RelativeMotion& motion, bool uncertain);
  std::optional<InclinometerSample> tilt_at(Stamp stamp) const;
  std::optional<double> compare_with_inclinometer(const VisualMotion& visual) const;
  void learn_inclinometer(const MotionEvidence& evidence);
  std::optional<WheelStep> wheel_step_since_frame(Stamp stamp) const;
  std::optional<double> compare_with_wheels(const VisualMotion& visual) const;
  std::optional<ForwardComparison> compare_forward(const VisualMotion& visual) const;

  // Wheels and zero-velocity updates: wheel_update.cpp.
  void update(const WheelSample& sample);
  void end_step_at_frame(Stamp stamp, bool vision_alone);
  std::optional<WheelSample> wheels_at(Stamp stamp) const;
  void update_by_step(const WheelSample& sample);
  WheelStep step_between(const WheelSample& from, const WheelSample& to) const;
  void estimate_slip(const WheelStep& step);
  void begin_step(const std::optional<WheelSample>& wheels);
  void update_zero_velocity(bool imu_stationary);
  bool wheels_stationary() const;
  bool still_stationary();

  // Absolute measurements: absolute_update.cpp.
  void update(const CompassSample& sample);
  void initialize_compass_offset(const CompassSample& sample, double sigma_rad);
  void update(const InclinometerSample& sample);
  double stated_sigma(const InclinometerSample& sample) const;
  void inflate_attitude(const Innovation& innovation);
  void update(const PoseConstraint& constraint);
  void update(const LateConstraint& constraint);
  void apply_constraint(const PoseConstraint& of_body, int pose);

  /// Corrections that preserve odom_from_body, and corrections of the motion since a clone.
  void correct_world(const Innovation& innovation);
  void correct_by_map(const Innovation& innovation);
  void preserve_odom(const Pose& world_from_body_before);
  void correct_motion(const Innovation& innovation, int clone);
  void correct_prediction(const Innovation& innovation);
  void set_odom_by_motion(int clone);
  bool accept(LocalizationSensor sensor, double nis, int rows, HealthReason why);

  LocalizationOptions options_;
  LeverArm arm_;
  Eigen::Vector3d wheel_centre_;  ///< relative to the IMU
  Vector6d drift_sigma_ratios_, constant_sigma_ratios_;
  MotionGates gates_;
  FilterMemory memory_;
};

}  // namespace spartan::internal
