// Localization: the pose of the rover from all available sensors.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"
#include "spartan/localization/localization_options.h"
#include "spartan/localization/measurement.h"
#include "spartan/localization/sensor_health.h"

namespace spartan {

/// Slip of the last wheel step of at least min_slip_distance_m.
struct WheelSlip {
  Stamp stamp;
  double slip = 0;  ///< 1 − travelled / counted
  double sigma = 0;
};

/// Direction of the world's x axis.
struct WorldHeading {
  bool east = false;  ///< x is east by a compass before the start; else x is the start heading
  /// Compass reading − heading in the world, counter-clockwise; if x is not east, the heading of east is minus this.
  std::optional<double> compass_offset_rad;
  double compass_offset_sigma_rad = 0;
};

struct LocalizationEstimate {
  Stamp stamp;                    ///< of the newest sample
  UncertainPose world_from_body;  ///< best estimate; jumps where map, compass or inclinometer correct it
  UncertainPose odom_from_body;   ///< never jumps; its covariance accumulates over the drive
  Pose world_from_odom;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();  ///< world
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();
  std::optional<WheelSlip> slip;
  WorldHeading heading;
  bool gravity_measured = false;  ///< z was aligned to measured gravity at the start; else to the start attitude
  Eigen::Vector3d up_in_world = Eigen::Vector3d::UnitZ();  ///< current estimate of the true vertical
  std::array<SensorHealth, kLocalizationSensors> health;   ///< indexed by LocalizationSensor

  const SensorHealth& health_of(LocalizationSensor sensor) const { return health[static_cast<std::size_t>(sensor)]; }
};

/// Fuses visual motions with IMU, wheel odometry, compass, inclinometer and map constraints. Vision is required, every
/// other sensor is optional: it may be absent, start late, fail or give wrong readings. Samples may arrive late and in
/// any order within `buffer_s`; samples that cannot be used are refused and counted, without an error. Not thread-safe.
///
/// The first pose defines the origin of the world exactly: z up by static alignment with IMU or inclinometer, x along
/// the horizontal part of `ahead_in_body`, or east if there were compass samples. The directions of gravity and north
/// in that world are estimated.
class Localizer {
 public:
  explicit Localizer(const LocalizationOptions& options);
  Localizer(Localizer&&) noexcept;
  Localizer& operator=(Localizer&&) noexcept;
  ~Localizer();

  /// Call once, at the first frame. `ahead_in_body`: the first left optical axis. Samples of the last 10 s up to
  /// `stamp` that were added before are used for static alignment only. `up_in_body`: an approximate vertical (1° to
  /// 2°) that is used if neither IMU nor inclinometer give one.
  void start(Stamp stamp, const Eigen::Vector3d& ahead_in_body, const std::optional<Eigen::Vector3d>& up_in_body = {});
  bool started() const;

  /// Returns whether the measurement was accepted into the buffer. Add one RelativeMotion for every frame after the
  /// first, measured or not; `from` must be the stamp of the frame before.
  bool add(const Measurement& measurement);
  /// Whether a sample with that stamp is not too late for the buffer.
  bool reaches(Stamp stamp) const;

  /// Estimate at the newest sample; identity before the start.
  LocalizationEstimate estimate() const;

  /// The memory as a versioned value; after restore() all further estimates are the same, bit for bit. Code
  /// `configuration` if the bytes are of another version or damaged.
  Bytes save() const;
  Status restore(const Bytes& bytes);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace spartan
