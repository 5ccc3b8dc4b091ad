// The memory of the filter from sample to sample.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "spartan/camera/samples.h"
#include "spartan/core/archive.h"
#include "spartan/localization/internal/alignment_window.h"
#include "spartan/localization/internal/error_state.h"
#include "spartan/localization/internal/imu_queue.h"
#include "spartan/localization/internal/inertial_noise.h"
#include "spartan/localization/internal/noise_ratio.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {

using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// Sums of IMU readings over a block of time, for their scatter.
struct StationaryBlock {
  Stamp from;
  double count = 0;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero(), accel = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_squares = Eigen::Vector3d::Zero(), accel_squares = Eigen::Vector3d::Zero();
};

struct InertialMemory {
  bool known = false;
  ImuSample last;    ///< its stamp by the clock of the cameras
  ImuQueue waiting;  ///< by the clock of the IMU
  Stamp changed;     ///< when the reading last changed (frozen sensors)
  InertialNoiseEstimate noise;
  bool aligned = false;  ///< biases, velocity and gravity are known well enough for integration
  Stamp waiting_since;   ///< begin of the search for the alignment
  AlignmentWindow window;
  Stamp level_from;
  double level_count = 0;
  Eigen::Vector3d level_force_sum = Eigen::Vector3d::Zero();  ///< world
  StationaryBlock block;
};

/// The visual motions that were used last, but for those of a stationary rover.
struct RecentMotion {
  std::uint32_t count = 0;                                 ///< as far as it matters
  double length_m = 0;                                     ///< of the longest; fades
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();  ///< of the last one, in the frame where it ended
  Stamp end;                                               ///< of the last one
};

/// Since the last frame.
struct VisionMemory {
  Stamp clone_stamp;
  Pose odom_from_clone;
  Matrix6d odom_covariance = Matrix6d::Zero();  ///< of odom_from_clone
  bool stationary = false;                      ///< the last visual motion was the identity
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d::Zero();
  /// Accumulated noise of the constant-velocity model (position, attitude, velocity), and for how long it was used.
  Matrix9d constant_velocity_noise = Matrix9d::Zero();
  double constant_velocity_s = 0;
  bool reset = false;  ///< the last motion contradicted the IMU, so that the velocity is uncertain
  RecentMotion recent;
  /// The last motion was rejected as wild; by it, world_from_imu at `doubted_at` would be `doubted_pose`.
  bool doubted = false;
  Stamp doubted_at;
  Pose doubted_pose;
  bool has_wheels = false;
  WheelSample wheels;  ///< at clone_stamp
  bool has_tilt = false;
  InclinometerSample tilt;            ///< the last one before clone_stamp, if it is fresh
  bool wheels_in_prediction = false;  ///< a step of the wheels since clone_stamp has corrected the motion
};

/// The current step of the wheels, or the current stop.
struct StepMemory {
  Stamp from;
  Pose odom_from_clone;
  bool has_wheels = false;
  WheelSample wheels;  ///< at its start
  bool stationary = false;
};

struct WheelMemory {
  bool known = false;
  WheelSample last, previous;
  WheelSample moved;  ///< the first reading that the later ones do not differ from
  bool slip_known = false;
  Stamp slip_stamp;
  double slip = 0, slip_sigma = 0;
};

struct InclinometerMemory {
  NoiseRatio noise;
  NoiseRatio of_motions;  ///< of the difference of two readings to the visual motion between them
  bool known = false;
  InclinometerSample last;
};

struct CompassMemory {
  static constexpr std::size_t kPending = 5;
  NoiseRatio noise;
  bool heading_east = false;  ///< the world's x is east by the readings before the start
  bool offset_known = false;
  std::uint32_t pending = 0;
  std::array<double, kPending> offsets{}, sigmas{};  ///< reading − heading, until the offset is initialized
};

struct FilterMemory {
  bool started = false;
  Stamp stamp;
  StateEstimate estimate;
  Pose world_from_odom;
  bool gravity_known = false;     ///< the tilt of gravity is an estimate by IMU or inclinometer
  bool gravity_measured = false;  ///< as LocalizationEstimate::gravity_measured
  InertialMemory imu;
  VisionMemory vision;
  StepMemory step;
  WheelMemory wheels;
  CompassMemory compass;
  InclinometerMemory inclinometer;
  std::array<SensorMonitor, kLocalizationSensors> monitors;

  /// Whether the IMU predicts the motion.
  bool inertial_usable() const {
    return imu.known && imu.aligned && monitor(LocalizationSensor::imu).state != SensorState::excluded;
  }

  SensorMonitor& monitor(LocalizationSensor sensor) { return monitors[static_cast<std::size_t>(sensor)]; }
  const SensorMonitor& monitor(LocalizationSensor sensor) const { return monitors[static_cast<std::size_t>(sensor)]; }
};

void put(ArchiveWriter& out, const FilterMemory& memory);
/// std::nullopt where a counter cannot be; other errors are those of the reader.
std::optional<FilterMemory> get_filter_memory(ArchiveReader& in);

}  // namespace spartan::internal
