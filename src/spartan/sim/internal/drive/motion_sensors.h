// Simulated IMU, wheel encoders, compass and inclinometer.
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/sim/internal/drive/body_motion.h"
#include "spartan/sim/scenario_options.h"
#include "spartan/sim/sensor_options.h"

namespace spartan::sim::internal {

/// The specified noise that the recording states.
SensorNoise specified_noise(const ImuOptions& imu, const CompassOptions& compass,
                            const InclinometerOptions& inclinometer);

/// The recording's clock at a time of the drive.
Stamp stamp_at(double time_s);

/// Angular rate and specific force in the body frame without errors.
ImuSample true_imu(const BodyMotion& motion, double time_s, double gravity_m_s2);

/// Samples of each sensor over the whole drive, with errors and faults; empty where the sensor is not enabled. The
/// errors depend on the options and the seed alone: a fault does not change the other samples.
std::vector<ImuSample> measure_imu(const BodyMotion& motion, const ImuOptions& options, double gravity_m_s2,
                                   const SensorFaults& faults, std::uint64_t seed);
std::vector<WheelSample> measure_wheels(const BodyMotion& motion, const ChassisOptions& chassis,
                                        const WheelOptions& options, const SensorFaults& faults, std::uint64_t seed);
std::vector<CompassSample> measure_compass(const BodyMotion& motion, const CompassOptions& options,
                                           const SensorFaults& faults, std::uint64_t seed);
std::vector<InclinometerSample> measure_inclinometer(const BodyMotion& motion, const InclinometerOptions& options,
                                                     const SensorFaults& faults, std::uint64_t seed);

}  // namespace spartan::sim::internal
