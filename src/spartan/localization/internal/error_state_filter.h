// The localization filter: one measurement after the other, in the order of time.
//
// An error-state Kalman filter (Solà 2017) with stochastic cloning (Roumeliotis & Burdick 2002) for motions measured
// between two moments. docs/math/localization.md has the formulas.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/localization_options.h"
#include "spartan/localization/measurement.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/propagation.h"

namespace spartan {

class ErrorStateFilter {
 public:
  explicit ErrorStateFilter(const LocalizationOptions& options);

  /// Lays the world from what the sensors said before, and stands at its origin.
  /// `before`: samples up to `stamp`, in order of time; motions and constraints among them do not count.
  void start(Stamp stamp, const Eigen::Vector3d& ahead_in_body, std::span<const Measurement> before,
             const std::optional<Eigen::Vector3d>& up_in_body = {});

  /// In the order of comes_before().
  void process(const Measurement& measurement);

  const FilterMemory& memory() const { return memory_; }
  void set_memory(const FilterMemory& memory) { memory_ = memory; }

  /// odom_from_body with the covariance that has gathered since the start.
  UncertainPose odom_from_body() const;

 private:
  // Time and IMU: error_state_filter.cpp.
  void move_to(Stamp stamp, const ImuSample* reached);
  void move_inertially(double seconds, const ImuSample& from, const ImuSample& to);
  void move_steadily(double seconds);
  void walk_biases(double seconds);
  bool inertial_usable() const;
  void take(const ImuSample& sample);
  void judge_reading(const ImuSample& sample);
  void turn_by_gyro(const ImuSample& sample);
  void find_level(const ImuSample& sample);
  void watch_stillness(const ImuSample& sample);

  // Motions between shots: shot_update.cpp.
  void take(const RelativeMotion& motion);
  bool measure_motion(const RelativeMotion& motion);
  void let_drift(int index, const Vector6d& sigmas, double steps);
  bool overrule_prediction(const Innovation& innovation, double square, const RelativeMotion& motion);
  bool wheels_confirm_prediction(const RelativeMotion& motion) const;
  void compare_gyro(const RelativeMotion& motion);
  void begin_shot(Stamp stamp);

  // Wheels and standing: step_update.cpp.
  void take(const WheelSample& sample);
  void end_step_at_shot(Stamp stamp);
  std::optional<WheelSample> wheels_at(Stamp stamp) const;
  void measure_step(const WheelSample& sample);
  WheelStep step_to(const WheelSample& sample) const;
  void state_slip(const WheelStep& step);
  void begin_step(const std::optional<WheelSample>& wheels);
  void hold_still(bool imu_still);
  bool wheels_stand() const;
  bool still_stands();

  // Directions and places: absolute_update.cpp.
  void take(const CompassSample& sample);
  void find_compass_offset(const CompassSample& sample, double sigma_rad);
  void take(const InclinometerSample& sample);
  void allow_for_rocking(const Innovation& innovation);
  void take(const PoseConstraint& constraint);
  void take(const LateConstraint& constraint);
  void hear_map(const PoseConstraint& constraint, int pose);

  /// Corrections that leave odom where it is, and those that tell the motion since a clone.
  void correct_world(const Innovation& innovation);
  void correct_by_map(const Innovation& innovation);
  void keep_odom(const Pose& world_from_body_before);
  void correct_motion(const Innovation& innovation, int clone);
  bool judge(LocalizationSensor sensor, double square, int rows, HealthReason why);

  LocalizationOptions options_;
  Vector6d drift_sigmas_, constant_sigmas_;
  std::array<double, 7> gates_{};  ///< by degrees of freedom
  double vision_gate_ = 0;
  FilterMemory memory_;
};

}  // namespace spartan
