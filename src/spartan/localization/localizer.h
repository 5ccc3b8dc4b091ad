// Localization: fuses vision, inertial sensors, wheels and absolute sensors into one pose.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/time.h"
#include "spartan/core/trajectory.h"
#include "spartan/localization/localization_options.h"

namespace spartan {

/// The relative motion of the body between two frames, as measured by visual odometry.
struct RelativeMotion {
  Stamp from, to;                          ///< of the two frames
  Pose previous_from_current;              ///< body frames; the exact identity means a stationary rover
  Matrix6d covariance = Matrix6d::Zero();  ///< of the right perturbation, (translation, rotation), m² rad²
  bool measured = true;                    ///< false: tracking was lost, the motion is not used
  bool keeps_reference = false;            ///< the next motion begins at `from`, too, not at `to`
  /// E: what each error of the calibration changes, at one standard deviation. Its part E Eᵀ of the covariance is that
  /// of errors which all motions share.
  Eigen::Matrix<double, 6, 8> by_calibration = Eigen::Matrix<double, 6, 8>::Zero();
  /// D: standard deviations to which the errors that last from motion to motion are in proportion. None: those of
  /// `covariance` without E Eᵀ.
  std::optional<Vector6d> lasting_sigma{};

  /// `covariance` without the part of the calibration.
  Matrix6d own_covariance() const;
  /// D; zero for a stationary rover.
  Vector6d drift_scale() const;
  bool is_stationary() const;
};

/// The sensors that are monitored: whether one is used, and why not.
enum class LocalizationSensor : std::uint8_t { vision, imu, wheels, compass, inclinometer, map };
inline constexpr int kLocalizationSensors = 6;
std::string_view name_of(LocalizationSensor sensor);

enum class SensorState : std::uint8_t {
  ok,
  suspect,   ///< its last sample was rejected
  excluded,  ///< not used; its samples are still gated, and enough consistent ones readmit it
  missing,   ///< no samples within its timeout
};
std::string_view name_of(SensorState state);

enum class HealthReason : std::uint8_t {
  none,
  disagrees,     ///< failed a chi-square test
  slips,         ///< the wheels' count differs from the motion of the rover
  frozen,        ///< identical readings
  out_of_range,  ///< rate or specific force beyond the physical range of a rover
  contradicted,  ///< vision contradicts its prediction
  not_aligned,   ///< its readings fit the visual motions with no biases and gravity
  wild,          ///< a single motion far from what IMU or wheels say
  outvoted,      ///< vision contradicts the IMU and the wheels, which agree
  implausible,   ///< a motion far off what those before it predict, which no sensor confirms
  lost,          ///< vision could not measure the motion
  never_seen,
  silent,
};

/// Why a sample is refused before it reaches the filter.
enum class Refusal : std::uint8_t { not_finite, too_late, too_early, duplicate, reversed };

/// Number of refused samples by reason.
struct RefusalCounts {
  std::int64_t not_finite = 0, too_late = 0, too_early = 0, duplicates = 0, reversed = 0;
  void count(Refusal refusal);
};

/// Chi-square test of an innovation: the measurement may be used where `nis` is at most `gate`.
struct InnovationTest {
  Stamp stamp;     ///< of the state that it was tested against
  double nis = 0;  ///< normalized innovation squared, rᵀ S⁻¹ r; the largest double where S is singular
  double gate = 0;
};

/// Report on a sensor at a time.
struct SensorHealth {
  SensorState state = SensorState::missing;
  std::string reason;                   ///< empty if the state is ok
  std::int64_t used = 0, rejected = 0;  ///< by the filter
  RefusalCounts refused;                ///< before the filter
  /// The last one. Of vision: against the prediction by the IMU; none where there is no such prediction.
  std::optional<InnovationTest> test;
};

/// Monitors one sensor by gating: ok → suspect at the first rejection, excluded after `excluded_after` consecutive
/// ones, readmitted after `readmit_after` consecutive samples that pass.
struct SensorMonitor {
  bool seen = false;
  Stamp last;
  SensorState state = SensorState::ok;  ///< never `missing`, which follows from `last`
  HealthReason reason = HealthReason::none;
  double nis = 0;  ///< normalized innovation squared that failed, and its gate
  double limit = 0;
  std::int64_t used = 0, rejected = 0;
  int passed_in_row = 0, failed_in_row = 0;
  std::optional<InnovationTest> test;  ///< the last one

  void see(Stamp stamp);
  /// Returns whether the sample is used: it passes the gate and the sensor is not, or no longer, excluded.
  bool accept(double normalized_innovation_squared, double gate, HealthReason why, int excluded_after,
              int readmit_after);
  void exclude(HealthReason why);
  void readmit();

  bool missing(Stamp now, double timeout_s) const;
  SensorHealth report(Stamp now, double timeout_s, const RefusalCounts& refusals) const;
};

/// A map constraint on the pose at the last frame that arrived when that frame was older than the buffer (the map of a
/// stop is made when the rover drives on): applied at a later time to the clone of that pose.
struct LateConstraint {
  Stamp stamp;  ///< when it is applied
  PoseConstraint at_frame;
};

/// Measurements with equal stamps are ordered by their index here: the IMU propagates to that time, vision corrects the
/// prediction, the others are gated against both.
using Measurement = std::variant<ImuSample, RelativeMotion, WheelSample, CompassSample, InclinometerSample,
                                 PoseConstraint, LateConstraint>;

inline Stamp stamp_of_measurement(const Measurement& m) {
  return std::visit(
      [](const auto& value) {
        if constexpr (requires { value.stamp; }) {
          return value.stamp;
        } else {
          return value.to;
        }
      },
      m);
}

/// Whether `a` is processed before `b`.
inline bool comes_before(const Measurement& a, const Measurement& b) {
  const Stamp at = stamp_of_measurement(a), bt = stamp_of_measurement(b);
  return at != bt ? at < bt : a.index() < b.index();
}

LocalizationSensor sensor_of(const Measurement& m);

/// Whether all numbers are finite and no variance or information is negative.
bool is_valid(const Measurement& m);

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

/// Biases of the IMU with their standard deviations, body frame.
struct InertialBiases {
  Eigen::Vector3d gyro_rad_s = Eigen::Vector3d::Zero(), gyro_sigma_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_m_s2 = Eigen::Vector3d::Zero(), accel_sigma_m_s2 = Eigen::Vector3d::Zero();
};

struct LocalizationEstimate {
  Stamp stamp;                    ///< of the newest sample
  UncertainPose world_from_body;  ///< best estimate; jumps where map, compass or inclinometer correct it
  UncertainPose odom_from_body;   ///< never jumps; its covariance accumulates over the drive
  Pose world_from_odom;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();  ///< world
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();
  bool imu_aligned = false;  ///< biases and velocity are known well enough to use the readings of the IMU
  InertialBiases biases;
  /// Stamp of the IMU minus stamp of the cameras at the same moment, with its standard deviation.
  double imu_time_offset_s = 0, imu_time_offset_sigma_s = 0;
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
  /// Code `configuration` where an option is out of bounds.
  static Result<Localizer> create(const LocalizationOptions& options);
  Localizer(Localizer&&) noexcept;
  Localizer& operator=(Localizer&&) noexcept;
  ~Localizer();

  /// Call once, at the first frame. `ahead_in_body`: the first left optical axis. Samples of the last 10 s up to
  /// `stamp` that were added before are used for static alignment only. `up_in_body`: an approximate vertical (1° to
  /// 2°) that is used if neither IMU nor inclinometer give one; `assumed_up_in_body`, if nothing else is known.
  void start(Stamp stamp, const Eigen::Vector3d& ahead_in_body, const std::optional<Eigen::Vector3d>& up_in_body = {},
             const Eigen::Vector3d& assumed_up_in_body = Eigen::Vector3d::UnitZ());
  bool started() const;

  /// Returns whether the measurement was accepted into the buffer. Add one RelativeMotion for every frame after the
  /// first, measured or not; `from` must be the frame before, or that of the motion before if it keeps its reference.
  bool add(const Measurement& measurement);
  /// Whether a sample with that stamp is not too late for the buffer.
  bool reaches(Stamp stamp) const;

  /// Estimate at the newest sample; identity before the start.
  LocalizationEstimate estimate() const;
  /// Estimate at a time of the buffer by the samples up to it, or predicted for a later time. Nothing before the
  /// buffer.
  std::optional<LocalizationEstimate> estimate_at(Stamp stamp) const;

  /// The memory as a versioned value; after restore() all further estimates are the same, bit for bit. Code
  /// `configuration` where the bytes are of another version, `store_damaged` where they are damaged.
  Bytes save() const;
  Status restore(const Bytes& bytes);

  /// From now on keeps the start and all accepted measurements for take_inputs().
  void keep_inputs();
  /// Those since the last call, as a versioned value for Smoother::add; empty if there are none.
  Bytes take_inputs();

 private:
  struct State;
  explicit Localizer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// How a Localizer was started.
struct LocalizationStart {
  Stamp stamp;
  Eigen::Vector3d ahead_in_body = Eigen::Vector3d::UnitX();
  std::optional<Eigen::Vector3d> up_in_body;
  Eigen::Vector3d assumed_up_in_body = Eigen::Vector3d::UnitZ();
};

struct SmoothedPose {
  Stamp stamp;
  UncertainPose world_from_body;
};

/// The poses of a drive at its frames by all its measurements, those after each frame included: a fixed-interval
/// smoother (Rauch, Tung & Striebel, 1965) over the filter of Localizer. Everything is kept in memory: about 1 kB for a
/// visual motion, 60 B for a sample of the IMU.
class Smoother {
 public:
  /// Code `configuration` where an option is out of bounds.
  static Result<Smoother> create(const LocalizationOptions& options);
  Smoother(Smoother&&) noexcept;
  Smoother& operator=(Smoother&&) noexcept;
  ~Smoother();

  /// How the localization was started.
  void start(const LocalizationStart& start);
  /// A measurement that Localizer::add accepted, in any order.
  void add(const Measurement& measurement);
  /// Both, by Localizer::take_inputs. Codes as Localizer::restore.
  Status add(const Bytes& inputs);
  /// At the start and at every visual motion after it, in order of time; nothing without a start.
  std::vector<SmoothedPose> smooth();

 private:
  struct State;
  explicit Smoother(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// A Localizer without any other sensor, in the world of one with all sensors. Without constraints its pose is the
/// product of the visual motions; its covariance accumulates theirs and the drift (docs/math/localization.md,
/// "Vision").
class VisionOnlyFilter {
 public:
  /// Code `configuration` where an option is out of bounds.
  static Result<VisionOnlyFilter> create(const LocalizationOptions& options);

  void start(Stamp stamp, const Pose& world_from_body);
  /// As Localizer::add.
  bool add(const RelativeMotion& motion) { return localizer_.add(motion); }
  bool add(PoseConstraint constraint);
  bool reaches(Stamp stamp) const { return localizer_.reaches(stamp); }
  bool started() const { return localizer_.started(); }

  UncertainPose world_from_body() const;

  Bytes save() const;
  Status restore(const Bytes& bytes);

 private:
  explicit VisionOnlyFilter(Localizer localizer) : localizer_(std::move(localizer)) {}
  Localizer localizer_;
  Pose world_from_own_;  // between the worlds: the own one always starts level and ahead
};

/// Propagates the covariance of a pose that is the product of motions, with the errors that last: white noise n, two
/// first-order Gauss–Markov processes z₁ and z₂ in units of each motion's standard deviations D, and the errors η of
/// the calibration, which are constant,
///
///     ξ' = Ad(M⁻¹) ξ + D (z₁ + z₂) + n + E η
///
/// (docs/math/localization.md, "Vision"). D and n are without the part of the calibration. Nothing is estimated: a
/// fixed amount of arithmetic for each motion. Equals the covariance of VisionOnlyFilter without constraints and with
/// an exact calibration to first order; where vision is lost, the motion's own covariance counts.
class DeadReckoning {
 public:
  /// Code `configuration` where an option is out of bounds.
  static Result<DeadReckoning> create(const VisionOptions& options);

  /// The next motion. It begins where the last one ended, or where the last one began if that keeps its reference.
  void add(const RelativeMotion& motion);
  /// Of the right perturbation of the pose since the start, which is exact; order (translation, rotation).
  Matrix6d covariance() const { return covariance_.topLeftCorner<6, 6>(); }

  /// The memory as a versioned value. Codes as Localizer::restore.
  Bytes save() const;
  Status restore(const Bytes& bytes);

 private:
  explicit DeadReckoning(const VisionOptions& options);

  static constexpr int kSize = 26;  // ξ, z₁, z₂, η
  using Covariance = Eigen::Matrix<double, kSize, kSize>;

  double white_noise_factor_, drift_correlation_frames_;
  Vector6d drift_sigma_ratios_ = Vector6d::Zero(), constant_sigma_ratios_ = Vector6d::Zero();
  Covariance covariance_ = Covariance::Zero();
  // Where the next motion begins, unless the last frame was lost and it begins there.
  Covariance at_reference_ = Covariance::Zero();
  Stamp reference_;
};

}  // namespace spartan
