// Initialization of the world frame: static alignment and initial heading (docs/conventions.md, "Frames").
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/pose.h"
#include "spartan/localization/localization_options.h"

namespace spartan {

/// Mean IMU reading before the start.
struct StaticReading {
  Eigen::Vector3d gyro_rad_s, accel_m_s2;
  double accel_sigma_m_s2 = 0, gyro_sigma_rad_s = 0;  ///< of the means
  bool stationary = false;                            ///< the rover was certainly stationary
};
/// Mean of samples in order of time. Nothing if there are fewer than 10 finite ones, their mean differs from gravity by
/// more than 5 % or they scatter by more than 10 % of it: the rover moved, or the readings have other units.
std::optional<StaticReading> static_reading(std::span<const ImuSample> samples, const LocalizationOptions& options);

struct Heading {
  double radians = 0;
  double sigma_rad = 0;  ///< of the mean, without a common offset of the readings
};
/// Mean of the readings that agree with the largest number of others within 3 σ (consensus). Nothing without readings,
/// or if not more than half of several agree.
std::optional<Heading> consensus_heading(std::span<const CompassSample> readings, double min_sigma_rad);

struct Tilt {
  double roll_rad = 0, pitch_rad = 0, sigma_rad = 0;
};
/// Median of the readings; nothing without readings.
std::optional<Tilt> median_tilt(std::span<const InclinometerSample> readings, double min_sigma_rad);

/// world_from_body at the start: origin at the body, z along `up_in_body`, the horizontal part of `ahead_in_body` at
/// `ahead_heading_rad` from x. If that axis is vertical, body x replaces it.
Pose first_pose(const Eigen::Vector3d& up_in_body, const Eigen::Vector3d& ahead_in_body, double ahead_heading_rad);

}  // namespace spartan
