// One simulated drive with random sensor errors and random odometry errors, and a localization that processes it.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"
#include "spartan/core/threads.h"
#include "spartan/localization/localizer.h"
#include "spartan/numerics/random.h"
#include "spartan/sim/internal/drive/motion_sensors.h"
#include "spartan/sim/internal/world/world.h"
#include "spartan/sim/scenario.h"

namespace spartan {

/// Sensors used in addition to vision.
struct Subset {
  bool imu = false, wheels = false, compass = false, inclinometer = false;
  static Subset of(int mask) { return {(mask & 1) != 0, (mask & 2) != 0, (mask & 4) != 0, (mask & 8) != 0}; }
  std::string name() const {
    std::string text = "vision";
    if (imu) text += "+imu";
    if (wheels) text += "+wheels";
    if (compass) text += "+compass";
    if (inclinometer) text += "+incl";
    return text;
  }
};

/// The true motion of a scenario and the times of its odometry frames.
struct TrueDrive {
  sim::Scenario scenario;
  std::unique_ptr<sim::internal::World> world;  // borrowed during construction of the motion
  std::unique_ptr<sim::internal::BodyMotion> motion;
  std::vector<double> frames_s;
  std::vector<Pose> poses;  ///< at the frames
  double length_m = 0;      ///< of the polyline through the poses
  /// Visual motions with the errors of a seed.
  std::function<std::vector<RelativeMotion>(const TrueDrive&, std::uint64_t seed)> odometry;
};

inline std::optional<TrueDrive> open_true_drive(const std::string& folder, const std::string& name) {
  const std::string file = folder + "/scenarios/" + name + ".yaml";
  const auto text = read_file(file);
  if (!text) return std::nullopt;
  const auto scenario = sim::parse_scenario(*text, file);
  if (!scenario) return std::nullopt;
  const auto rig = read_rig(folder + "/rigs/" + scenario->rig + ".yaml");
  if (!rig) return std::nullopt;
  const auto plan = sim::plan_drive(*scenario, *rig, *text, file);
  if (!plan) return std::nullopt;
  TrueDrive drive;
  drive.scenario = *scenario;
  drive.world = std::make_unique<sim::internal::World>(sim::internal::make_world(*scenario, *plan));
  drive.motion = std::make_unique<sim::internal::BodyMotion>(
      *plan, sim::internal::WheelGround{drive.world->shape, drive.world->wheel_lift}, scenario->chassis, ThreadPool(2));
  for (const sim::PlannedFrame& frame : plan->frames()) {
    const auto pair =
        std::find_if(rig->pairs.begin(), rig->pairs.end(), [&](const auto& p) { return p.name == frame.pair; });
    if (pair == rig->pairs.end() || !pair->for_odometry) continue;
    drive.frames_s.push_back(frame.time_s);
    drive.poses.push_back(drive.motion->world_from_body(frame.time_s));
  }
  for (std::size_t i = 1; i < drive.poses.size(); ++i)
    drive.length_m += (drive.poses[i].translation() - drive.poses[i - 1].translation()).norm();
  return drive;
}

/// Simulated measurements of the sensors and the odometry on one drive, in order of time.
struct DrawnDrive {
  std::vector<ImuSample> imu;
  std::vector<WheelSample> wheels;
  std::vector<CompassSample> compass;
  std::vector<InclinometerSample> inclinometer;
  std::vector<RelativeMotion> motions;
};

inline DrawnDrive draw(const TrueDrive& drive, const sim::SensorFaults& faults, const sim::CompassOptions& compass,
                       std::uint64_t seed) {
  const sim::Scenario& s = drive.scenario;
  DrawnDrive d;
  d.imu = sim::internal::measure_imu(*drive.motion, s.imu, s.gravity_m_s2, faults, seed);
  d.wheels = sim::internal::measure_wheels(*drive.motion, s.chassis, s.wheels, faults, seed);
  d.compass = sim::internal::measure_compass(*drive.motion, compass, faults, seed);
  d.inclinometer = sim::internal::measure_inclinometer(*drive.motion, s.inclinometer, faults, seed);
  d.motions = drive.odometry(drive, seed);
  return d;
}

/// One measurement with its time of arrival, which may differ from its time stamp.
struct Arrival {
  std::int64_t at_ns = 0;
  Measurement measurement;
};

inline std::vector<Arrival> arrivals(const DrawnDrive& d, const Subset& subset) {
  std::vector<Arrival> all;
  const auto add = [&](const auto& samples) {
    for (const auto& s : samples) all.push_back({stamp_of_measurement(s).ns, s});
  };
  if (subset.imu) add(d.imu);
  if (subset.wheels) add(d.wheels);
  if (subset.compass) add(d.compass);
  if (subset.inclinometer) add(d.inclinometer);
  add(d.motions);
  std::stable_sort(all.begin(), all.end(), [](const Arrival& a, const Arrival& b) {
    return a.at_ns != b.at_ns ? a.at_ns < b.at_ns : a.measurement.index() < b.measurement.index();
  });
  return all;
}

/// Error of the localization at a frame, relative to the first pose.
struct FrameError {
  double time_s = 0, distance_m = 0;  ///< distance_m: position error
  double nees_position = 0, nees_attitude = 0, nees_pose = 0;
};
/// When a fault of a sensor was first reported: its state is not ok, or one of its samples was refused.
struct Detection {
  double after_s = 0;
  int samples = 0;  ///< of the sensor, since the fault began
};
struct Watch {
  LocalizationSensor sensor = LocalizationSensor::vision;
  double from_s = 0;
};
struct TrialResult {
  std::vector<FrameError> frames;
  double ate_m = 0, final_percent = 0;
  LocalizationEstimate last;
  std::optional<Detection> detection;
  std::optional<std::size_t> imu_aligned_at;  ///< first frame at which the readings of the IMU were used
  std::array<std::array<double, 4>, kLocalizationSensors> states_s{};  ///< frames in each state, by sensor
};

inline LocalizationOptions options_for(const TrueDrive& drive) {
  LocalizationOptions options;
  // A recording specifies it.
  options.gravity_m_s2 = drive.scenario.gravity_m_s2;
  const sim::Scenario& s = drive.scenario;
  return with_specified_noise(options, sim::internal::specified_noise(s.imu, s.compass, s.inclinometer));
}

inline void watch_for(const Watch& watch, const Localizer& localizer, const Arrival& arrival, int& samples,
                      TrialResult& result) {
  constexpr double kLongest_s = 60;
  const double after = seconds_between(sim::internal::stamp_at(watch.from_s), Stamp{arrival.at_ns});
  if (result.detection || after < 0 || after > kLongest_s) return;
  samples += sensor_of(arrival.measurement) == watch.sensor ? 1 : 0;
  const SensorHealth health = localizer.estimate().health_of(watch.sensor);
  const RefusalCounts& r = health.refused;
  if (health.state != SensorState::ok || r.not_finite + r.too_late + r.too_early + r.duplicates + r.reversed > 0)
    result.detection = Detection{after, samples};
}

inline TrialResult run_trial(const TrueDrive& drive, const std::vector<Arrival>& all,
                             const LocalizationOptions& options, const std::optional<Watch>& watch = {}) {
  Localizer localizer = Localizer::create(options).value();
  TrialResult result;
  Pose first;  // of the localization, relative to which errors are measured
  const std::int64_t start_ns = sim::internal::stamp_at(drive.frames_s.front()).ns;
  std::size_t frame = 0;
  double squares = 0;
  int samples_since = 0;
  for (const Arrival& arrival : all) {
    if (!localizer.started() && arrival.at_ns > start_ns) {
      localizer.start({start_ns}, Eigen::Vector3d::UnitX());
      first = localizer.estimate().world_from_body.pose;
    }
    localizer.add(arrival.measurement);
    if (watch && localizer.started()) watch_for(*watch, localizer, arrival, samples_since, result);
    const auto* motion = std::get_if<RelativeMotion>(&arrival.measurement);
    if (motion == nullptr || ++frame >= drive.poses.size()) continue;
    result.last = localizer.estimate();
    const LocalizationEstimate& e = result.last;
    for (std::size_t i = 0; i < result.states_s.size(); ++i)
      result.states_s[i][static_cast<std::size_t>(e.health[i].state)] += 1;
    if (e.imu_aligned && !result.imu_aligned_at) result.imu_aligned_at = frame;
    const Pose estimate = first.inverse() * e.world_from_body.pose,
               truth = drive.poses[0].inverse() * drive.poses[frame];
    const Vector6d error = log_se3(estimate.inverse() * truth);
    const Matrix6d& p = e.world_from_body.covariance;
    FrameError s;
    s.time_s = drive.frames_s[frame];
    s.distance_m = (estimate.translation() - truth.translation()).norm();
    const Eigen::Matrix3d position = p.topLeftCorner<3, 3>(), attitude = p.bottomRightCorner<3, 3>();
    const Eigen::Vector3d rho = error.head<3>(), phi = error.tail<3>();
    s.nees_position = rho.dot(position.ldlt().solve(rho));
    s.nees_attitude = phi.dot(attitude.ldlt().solve(phi));
    s.nees_pose = error.dot(p.ldlt().solve(error));
    squares += s.distance_m * s.distance_m;
    result.frames.push_back(s);
  }
  result.ate_m = std::sqrt(squares / static_cast<double>(std::max<std::size_t>(1, result.frames.size())));
  result.final_percent = 100 * result.frames.back().distance_m / drive.length_m;
  return result;
}

struct Seeds {
  int first = 1, count = 30;
};

/// trial(seed) for each seed, in their order.
template <class Trial>
std::vector<TrialResult> run_trials(const Seeds& seeds, const ThreadPool& workers, const Trial& trial) {
  std::vector<TrialResult> results(static_cast<std::size_t>(seeds.count));
  workers.parallel_for(0, seeds.count, 1, [&](int from, int to) {
    for (int i = from; i < to; ++i)
      results[static_cast<std::size_t>(i)] = trial(static_cast<std::uint64_t>(seeds.first + i));
  });
  return results;
}

}  // namespace spartan
