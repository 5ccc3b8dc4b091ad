// The current step of the wheels, or the current stop.
#pragma once

#include <optional>

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

/// Maximum age of the last sample of the wheels.
inline constexpr double kFreshWheels_s = 0.5;

/// Extrapolates the counts of the wheels to a time just after their last sample, at constant speed. None if they cannot
/// tell.
std::optional<WheelSample> wheels_at(const WheelMemory& wheels, Stamp stamp);

/// Turning centre of the wheels, relative to the IMU.
Eigen::Vector3d turning_centre(const LocalizationOptions& options);

/// What the wheels measure between two samples, with its standard deviations.
WheelStep step_between(const WheelSample& from, const WheelSample& to, const WheelOdometryOptions& options);

/// The step, or the stop, begins at the present pose.
void begin_step(FilterMemory& memory, const std::optional<WheelSample>& wheels);

/// Whether a stop goes on. Its end is detected by the IMU: without a usable one the rover does not count as stationary.
bool still_stationary(FilterMemory& memory, double imu_timeout_s);

}  // namespace spartan::internal
