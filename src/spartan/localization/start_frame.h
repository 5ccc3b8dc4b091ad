// Where the world lies: what the sensors said before and at the first shot (docs/conventions.md, "Frames").
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/pose.h"
#include "spartan/localization/localization_options.h"

namespace spartan {

/// The IMU's mean over the time before the start.
struct RestReading {
  Eigen::Vector3d gyro_rad_s, accel_m_s2;
  double accel_sigma_m_s2 = 0, gyro_sigma_rad_s = 0;  ///< of the means
  bool still = false;                                 ///< the rover surely stood
};
/// From samples in order of time. Nothing where there are fewer than 10 finite ones, where their mean differs from
/// gravity by more than 5 % or scatters by more than 10 % of it: the rover was not at rest, or the sensor is in other
/// units.
std::optional<RestReading> static_reading(std::span<const ImuSample> samples, const LocalizationOptions& options);

struct Heading {
  double radians = 0;
  double sigma_rad = 0;  ///< of the mean, as far as the readings differ among themselves
};
/// The mean of the readings that agree with most others within 3 σ; nothing where no more than half of several agree.
std::optional<Heading> agreed_heading(std::span<const CompassSample> readings, double least_sigma_rad);

struct Tilt {
  double roll_rad = 0, pitch_rad = 0, sigma_rad = 0;
};
/// The median of the readings.
std::optional<Tilt> median_tilt(std::span<const InclinometerSample> readings, double least_sigma_rad);

/// world_from_body at the start: origin at the body, z along `up_in_body`, the horizontal part of `ahead_in_body` at
/// `ahead_heading` from x. Where that axis is vertical, body x takes its place.
Pose first_pose(const Eigen::Vector3d& up_in_body, const Eigen::Vector3d& ahead_in_body, double ahead_heading_rad);

}  // namespace spartan
