// Localization: where the rover is, from all the sensors that there are.
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

/// Of the last step of the wheels that was long enough.
struct WheelSlip {
  Stamp stamp;
  double slip = 0;  ///< 1 − travelled / counted
  double sigma = 0;
};

/// What x of the world means, and how far it is from east.
struct WorldHeading {
  bool east = false;  ///< a compass said where east is before the start; else x is the start heading
  /// Compass readings less headings in the world, counter-clockwise; where x is not east, east lies at minus this.
  std::optional<double> compass_offset_rad;
  double compass_offset_sigma_rad = 0;
};

struct LocalizationEstimate {
  Stamp stamp;                    ///< of the newest sample
  UncertainPose world_from_body;  ///< the best there is; jumps where the map or a direction corrects it
  UncertainPose odom_from_body;   ///< never jumps; its covariance gathers all along the way
  Pose world_from_odom;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();  ///< world
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();
  std::optional<WheelSlip> slip;
  WorldHeading heading;
  bool gravity_measured = false;  ///< z is up by a measurement at the start; else along the start attitude
  Eigen::Vector3d up_in_world = Eigen::Vector3d::UnitZ();  ///< the true vertical, as far as it is known now
  std::array<SensorHealth, kLocalizationSensors> health;   ///< by LocalizationSensor

  const SensorHealth& health_of(LocalizationSensor sensor) const { return health[static_cast<std::size_t>(sensor)]; }
};

/// Fuses visual motions with whatever else there is. Vision is required, everything else optional: it may be absent,
/// start late, stop or lie. Samples may come late and in any order within `buffer_s`; what cannot be used is refused
/// and counted, never thrown. Not thread-safe.
///
/// The world stands at the first pose, exactly: z up by what IMU or inclinometer said until then, x along the
/// horizontal part of the direction ahead, or east where a compass was heard. What is uncertain is where gravity and
/// north lie in it.
class Localizer {
 public:
  explicit Localizer(const LocalizationOptions& options);
  Localizer(Localizer&&) noexcept;
  Localizer& operator=(Localizer&&) noexcept;
  ~Localizer();

  /// At the first shot, once. `ahead_in_body`: the first left optical axis. Samples up to `stamp` that were added
  /// before level the world and are done with; of those only the last 10 s count.
  /// `up_in_body`: where it is known from elsewhere (to a degree or two); it counts where no sample says better.
  void start(Stamp stamp, const Eigen::Vector3d& ahead_in_body, const std::optional<Eigen::Vector3d>& up_in_body = {});
  bool started() const;

  /// Whether it was taken. One RelativeMotion for every shot after the first, measured or not; `from` must be the shot
  /// before.
  bool add(const Measurement& measurement);
  /// Whether the buffer still holds that moment.
  bool reaches(Stamp stamp) const;

  /// At the newest sample; identity before the start.
  LocalizationEstimate estimate() const;

  /// The memory as a versioned value; after restore() of it all that follows is the same, bit for bit.
  Bytes save() const;
  Status restore(const Bytes& bytes);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace spartan
