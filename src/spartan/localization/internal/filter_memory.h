// All that the filter remembers from sample to sample.
#pragma once

#include <Eigen/Core>
#include <array>

#include "spartan/camera/samples.h"
#include "spartan/core/archive.h"
#include "spartan/localization/internal/error_state.h"
#include "spartan/localization/sensor_health.h"

namespace spartan {

using Matrix9d = Eigen::Matrix<double, 9, 9>;

/// The IMU's readings over a short while, for their scatter.
struct StillnessBlock {
  Stamp from;
  double count = 0;
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero(), accel = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyro_squares = Eigen::Vector3d::Zero(), accel_squares = Eigen::Vector3d::Zero();
};

struct InertialMemory {
  bool known = false;
  ImuSample last;
  Stamp changed;  ///< since when `last` has been read
  bool levelled = false;
  StillnessBlock block;
  Stamp level_from;
  double level_count = 0;
  Eigen::Vector3d level_force = Eigen::Vector3d::Zero();     ///< sum, world
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();  ///< by the gyro alone since the last shot
  double turn_s = 0;
  bool turn_whole = false;
};

/// Since the last shot.
struct VisionMemory {
  Stamp clone_stamp;
  Pose odom_from_clone;
  Matrix6d odom_covariance = Matrix6d::Zero();  ///< of odom_from_clone
  bool stood = false;                           ///< the last motion was none
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d::Zero();
  Matrix9d unmeasured_noise = Matrix9d::Zero();  ///< of the time without an IMU: position, attitude, velocity
  double unmeasured_s = 0;
};

/// The present step of the wheels (or of standing).
struct StepMemory {
  Stamp from;
  Pose odom_from_clone;
  bool has_wheels = false;
  WheelSample wheels;  ///< at its start
  bool standing = false;
};

struct WheelMemory {
  bool known = false;
  WheelSample last, previous;
  WheelSample moved;  ///< the reading (and since when) that the last ones do not differ from
  bool slip_known = false;
  Stamp slip_stamp;
  double slip = 0, slip_sigma = 0;
};

struct CompassMemory {
  static constexpr std::size_t kPending = 5;
  bool heading_east = false;  ///< the world's x is east, as far as the first readings say
  bool offset_known = false;
  std::uint32_t pending = 0;
  std::array<double, kPending> offsets{}, sigmas{};  ///< readings less heading, before the offset is known
};

struct FilterMemory {
  bool started = false;
  Stamp stamp;
  Belief belief;
  Pose world_from_odom;
  bool gravity_measured = false;
  InertialMemory imu;
  VisionMemory vision;
  StepMemory step;
  WheelMemory wheels;
  CompassMemory compass;
  std::array<SensorJudge, kLocalizationSensors> judges;

  SensorJudge& judge(LocalizationSensor sensor) { return judges[static_cast<std::size_t>(sensor)]; }
  const SensorJudge& judge(LocalizationSensor sensor) const { return judges[static_cast<std::size_t>(sensor)]; }
};

void put(ArchiveWriter& out, const FilterMemory& memory);
FilterMemory get_filter_memory(ArchiveReader& in);

}  // namespace spartan
