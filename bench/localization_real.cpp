// The localization on real inertial sensors: `make bench-localization_real ARGS="..."`.
//
//   localization_real [--data FOLDER] [--from RECORDINGS] [--runs RUNS] [--errors NAME,NAME] [--seeds N]
//                     [euroc_v101] [tumvi_room1] [kitti_0013]
//
// IMU (and wheels) are those of the recordings. Vision is what `spartan run` measured where there are images (RUNS/NAME
// holds that run), and beyond them the motions of the ground truth at the rate of the frames, with errors of the
// odometry: those of rendered drives (RECORDINGS/NAME with the run RUNS/NAME, --errors), scaled to the covariance of
// the motions that were measured, and the errors of an ordinary calibration. Each seed draws both anew.
#include <fmt/format.h>

#include <cstdlib>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "real_drives.h"
#include "standard_recordings.h"

namespace spartan {
namespace {

/// An attitude by gyros does not change by itself within a second, the error of one pose of the ground truth does.
constexpr std::size_t kTiltWindow_frames = 20;
constexpr double kDegrees = 180 / std::numbers::pi;

/// The visual motions of one trial, body frame.
std::vector<RelativeMotion> vision(const RealDrive& d, const OdometryErrors& errors, std::uint64_t seed) {
  Random random(seed, 502);
  CalibrationErrors calibration;
  calibration.pan_tilt_deg = 0;
  Eigen::Matrix<double, 8, 1> eta;
  for (int i = 0; i < 8; ++i) eta[i] = random.normal();
  const WhitenedErrors whitened = errors.draw(d.frames.size(), seed);
  const Matrix6d root = d.covariance.llt().matrixL(), ad = adjoint(d.body_from_left);
  Matrix6d of_truth = Matrix6d::Zero();
  of_truth.diagonal().head<3>().setConstant(d.truth_sigma_m * d.truth_sigma_m);
  of_truth.diagonal().tail<3>().setConstant(d.truth_sigma_rad * d.truth_sigma_rad);
  of_truth /= VisionOptions().white_noise_factor;  // by which the filter multiplies the covariance
  std::vector<RelativeMotion> motions;
  for (std::size_t i = 1; i < d.frames.size(); ++i) {
    RelativeMotion m;
    m.from = d.frames[i - 1].stamp;
    m.to = d.frames[i].stamp;
    const auto same = std::find_if(d.measured.begin(), d.measured.end(), [&](const MeasuredMotion& o) {
      return std::abs(o.from.ns - m.from.ns) < 1'000'000 && std::abs(o.to.ns - m.to.ns) < 1'000'000;
    });
    if (same != d.measured.end()) {
      m.previous_from_current = d.body_from_left * same->previous_from_current * d.body_from_left.inverse();
      m.covariance = ad * same->covariance * ad.transpose();
      m.measured = same->measured;
      m.by_calibration = calibration_effect(m.previous_from_current, d.body_from_left, d.rig, d.pair, calibration);
    } else {
      const Pose truth = d.frames[i - 1].pose.inverse() * d.frames[i].pose;
      m.by_calibration = calibration_effect(truth, d.body_from_left, d.rig, d.pair, calibration);
      const Vector6d error = ad * (root * whitened[i]) + m.by_calibration * eta;
      m.previous_from_current = truth * exp_se3(error);
      m.covariance = ad * d.covariance * ad.transpose() + of_truth + m.by_calibration * m.by_calibration.transpose();
      m.lasting_sigma = (ad * d.covariance * ad.transpose()).diagonal().cwiseSqrt();  // the truth's noise does not last
      m.measured = d.motion_known[i];
    }
    motions.push_back(m);
  }
  return motions;
}

struct Sensors {
  bool imu = true, wheels = false;
};

/// At one frame.
struct FrameResult {
  double time_s = 0, position_m = 0, sigma_m = 0, attitude_deg = 0, heading_deg = 0;
  double nees_position = 0, nees_pose = 0;
  Eigen::Vector2d up_error_deg = Eigen::Vector2d::Zero();  ///< error of roll and pitch, as a tilt in the true world
  LocalizationEstimate estimate;
};

struct DriveResult {
  std::vector<FrameResult> frames;
  double mean(double FrameResult::*value) const {
    double sum = 0;
    for (const FrameResult& f : frames) sum += f.*value;
    return sum / static_cast<double>(frames.size());
  }
  int imu_not_ok() const {
    return static_cast<int>(std::count_if(frames.begin(), frames.end(), [](const FrameResult& f) {
      return f.estimate.health_of(LocalizationSensor::imu).state != SensorState::ok;
    }));
  }
};

DriveResult localize(const RealDrive& d, const std::vector<RelativeMotion>& motions, const Sensors& with) {
  std::vector<Measurement> all;
  if (with.imu) all.insert(all.end(), d.imu.begin(), d.imu.end());
  if (with.wheels) all.insert(all.end(), d.wheels.begin(), d.wheels.end());
  all.insert(all.end(), motions.begin(), motions.end());
  std::stable_sort(all.begin(), all.end(), comes_before);
  LocalizationOptions options = with_specified_noise({}, d.noise);
  if (!d.wheels.empty()) options.wheels.use_rotation = false;
  Localizer localizer = Localizer::create(options).value();
  const Stamp start = d.frames[0].stamp;
  // What `spartan run` does: the first second of the IMU gives the vertical where none came before.
  std::optional<Eigen::Vector3d> up;
  if (with.imu) {
    std::vector<ImuSample> first;
    for (const ImuSample& s : d.imu) {
      if (seconds_between(d.imu.front().stamp, s.stamp) < 1) first.push_back(s);
    }
    if (const auto rest = static_reading(first, options)) up = rest->accel_m_s2.normalized();
  }
  if (!up) up = d.body_from_left.rotation() * -Eigen::Vector3d::UnitY();
  DriveResult result;
  Pose first;
  std::size_t frame = 0;
  for (const Measurement& m : all) {
    if (!localizer.started() && stamp_of_measurement(m) > start) {
      localizer.start(start, d.body_from_left.rotation() * Eigen::Vector3d::UnitZ(), up);
      first = localizer.estimate().world_from_body.pose;
    }
    localizer.add(m);
    if (!std::holds_alternative<RelativeMotion>(m)) continue;
    ++frame;
    FrameResult f;
    f.estimate = localizer.estimate();
    const UncertainPose& estimate = f.estimate.world_from_body;
    const Pose truth = d.frames[0].pose.inverse() * d.frames[frame].pose, ours = first.inverse() * estimate.pose;
    const Vector6d error = log_se3(ours.inverse() * truth);
    f.time_s = seconds_between(start, d.frames[frame].stamp);
    f.position_m = (ours.translation() - truth.translation()).norm();
    f.sigma_m = std::sqrt(estimate.covariance.diagonal().head<3>().sum());
    f.attitude_deg = kDegrees * error.tail<3>().norm();
    const Eigen::Matrix3d position = estimate.covariance.topLeftCorner<3, 3>();
    const Eigen::Vector3d rho = error.head<3>();
    f.nees_position = rho.dot(position.ldlt().solve(rho));
    f.nees_pose = error.dot(estimate.covariance.ldlt().solve(error));
    const Eigen::Vector3d up_here = estimate.pose.rotation().conjugate() * f.estimate.up_in_world,
                          true_up = d.frames[frame].pose.rotation().conjugate() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d in_world = d.frames[frame].pose.rotation() * up_here;
    const double tilt = std::acos(std::clamp(up_here.dot(true_up), -1.0, 1.0)), length = in_world.head<2>().norm();
    if (length > 0) f.up_error_deg = kDegrees * tilt / length * in_world.head<2>();
    const Eigen::Vector3d ahead = d.body_from_left.rotation() * Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d a = ours.rotation() * ahead, b = truth.rotation() * ahead;
    const Eigen::Vector3d axis = first.inverse().rotation() * f.estimate.up_in_world;
    f.heading_deg = kDegrees * std::abs(std::atan2(axis.dot(a.cross(b)), a.dot(b) - axis.dot(a) * axis.dot(b)));
    result.frames.push_back(f);
  }
  return result;
}

// Vision is lost in [from_s, from_s + length_s).
std::vector<RelativeMotion> with_gap(const RealDrive& d, std::vector<RelativeMotion> motions, double from_s,
                                     double length_s) {
  for (RelativeMotion& m : motions) {
    const double to = seconds_between(d.frames[0].stamp, m.to), from = seconds_between(d.frames[0].stamp, m.from);
    if (to > from_s && from < from_s + length_s) m.measured = false;
  }
  return motions;
}

// Biases of the gyro at a frame, against the reference if there is one.
std::string gyro_bias_text(const RealDrive& d, const FrameResult& f) {
  const InertialBiases& b = f.estimate.biases;
  const double sigma = 1e3 * b.gyro_sigma_rad_s.norm();
  return d.biases ? fmt::format("{:.2f}, {:.2f}", 1e3 * (b.gyro_rad_s - d.biases->gyro_rad_s).norm(), sigma)
                  : fmt::format("({:.2f}), {:.2f}", 1e3 * b.gyro_rad_s.norm(), sigma);
}

/// Errors of roll and pitch from 5 s on, degrees: RMS, 95 %, largest.
std::string tilt_text(const std::vector<FrameResult>& frames, double after_s, std::size_t half_window) {
  std::vector<double> errors;
  double squares = 0;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].time_s < after_s) continue;
    const std::size_t first = i < half_window ? 0 : i - half_window,
                      last = std::min(i + half_window, frames.size() - 1);
    Eigen::Vector2d error;
    for (int axis = 0; axis < 2; ++axis) {
      std::vector<double> near;
      for (std::size_t k = first; k <= last; ++k) near.push_back(frames[k].up_error_deg[axis]);
      std::nth_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(near.size() / 2), near.end());
      error[axis] = near[near.size() / 2];
    }
    errors.push_back(error.norm());
    squares += error.squaredNorm();
  }
  if (errors.empty()) return "";
  std::sort(errors.begin(), errors.end());
  return fmt::format("{:.3f}, {:.3f}, {:.3f}", std::sqrt(squares / static_cast<double>(errors.size())),
                     errors[errors.size() * 95 / 100], errors.back());
}

void print_result(const RealDrive& d, int seed, const Sensors& sensors, const DriveResult& r) {
  constexpr double kAfter_s = 5 - 0.01;
  double squares = 0;
  for (const FrameResult& f : r.frames) squares += f.position_m * f.position_m;
  const FrameResult* const end = &r.frames.back();
  const auto first_after =
      std::find_if(r.frames.begin(), r.frames.end(), [](const FrameResult& f) { return f.time_s >= kAfter_s; });
  const FrameResult& after = first_after == r.frames.end() ? *end : *first_after;
  fmt::print(
      "| {} | vision{}{} | {:.1f}, {:.1f} | {:.1f} | {:.3f}, {:.3f} | {} | {} | {} | {} | {} | {:.2f}, {:.2f} |\n",
      seed, sensors.imu ? "+imu" : "", sensors.wheels ? "+wheels" : "",
      1e3 * std::sqrt(squares / static_cast<double>(r.frames.size())), 1e3 * end->position_m, 1e3 * end->sigma_m,
      end->attitude_deg, end->heading_deg, tilt_text(r.frames, kAfter_s, 0),
      tilt_text(r.frames, kAfter_s, kTiltWindow_frames / 2), sensors.imu ? gyro_bias_text(d, after) : "",
      sensors.imu ? fmt::format("{:.2f}, {:.2f}", 1e3 * end->estimate.imu_time_offset_s,
                                1e3 * end->estimate.imu_time_offset_sigma_s)
                  : "",
      sensors.imu ? r.imu_not_ok() : 0, r.mean(&FrameResult::nees_position), r.mean(&FrameResult::nees_pose));
}

void print_drive(const RealDrive& d, const OdometryErrors& errors, int seeds, const Sensors& with) {
  const Vector6d odometry = d.covariance.diagonal().cwiseSqrt();
  fmt::print("\n## {}: {:.1f} m, {:.0f} s, {} frames, {} seeds\n\n", d.name, d.length_m,
             seconds_between(d.frames.front().stamp, d.frames.back().stamp), d.frames.size(), seeds);
  fmt::print(
      "Standard deviations of the odometry, left camera: {:.3f} {:.3f} {:.3f} mm, {:.3f} {:.3f} {:.3f} mrad; of the "
      "ground truth: {} mm, {} mrad\n\n",
      1e3 * odometry[0], 1e3 * odometry[1], 1e3 * odometry[2], 1e3 * odometry[3], 1e3 * odometry[4], 1e3 * odometry[5],
      1e3 * d.truth_sigma_m, 1e3 * d.truth_sigma_rad);
  fmt::print(
      "Roll and pitch, gyro bias: after 5 s. Gyro bias: difference to the reference, or the estimate in brackets. "
      "Median: of the error of roll and of pitch over {} frames.\n\n"
      "| seed | sensors | ATE, end, mm | 1 sigma | attitude, heading at the end, deg | roll and pitch, RMS, 95 %, "
      "largest, deg | the same of the median, deg | gyro bias, 1 sigma, mrad/s | clock of the IMU, 1 sigma, ms | IMU "
      "not ok, frames | mean NEES "
      "position, pose |\n|---|---|---|---|---|---|---|---|---|---|---|\n",
      kTiltWindow_frames);
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto motions = vision(d, errors, static_cast<std::uint64_t>(seed));
    for (const Sensors& sensors : {Sensors{false, false}, with})
      print_result(d, seed, sensors, localize(d, motions, sensors));
  }
}

// Error of the motion over gaps of vision that begin at several times, each in a run of its own.
void print_gaps(const RealDrive& d, const OdometryErrors& errors, double length_s, double first_s, double every_s) {
  const double seconds = seconds_between(d.frames.front().stamp, d.frames.back().stamp);
  fmt::print(
      "\n{}, vision lost for {:.0f} s:\n\n| from, s | error that the gap adds, mm | sigma at its end, mm | NEES of "
      "the position |\n|---|---|---|---|\n",
      d.name, length_s);
  const auto motions = vision(d, errors, 1);
  const DriveResult whole = localize(d, motions, {});
  for (double from = first_s; from + length_s + 1 < seconds; from += every_s) {
    const DriveResult r = localize(d, with_gap(d, motions, from, length_s), {});
    std::size_t end = 0;
    while (end + 1 < r.frames.size() && r.frames[end].time_s < from + length_s) ++end;
    const Pose a = whole.frames[end].estimate.world_from_body.pose, b = r.frames[end].estimate.world_from_body.pose;
    fmt::print("| {:.1f} | {:.1f} | {:.1f} | {:.2f} |\n", from, 1e3 * (a.translation() - b.translation()).norm(),
               1e3 * r.frames[end].sigma_m, r.frames[end].nees_position);
  }
}

void run(const std::vector<std::string>& words) {
  const char* const data = std::getenv("SPARTAN_DATA");
  RecordingArguments arguments = read_arguments(
      words,
      {{"--data", data != nullptr ? data : "../shared/data"}, {"--runs", "runs"}, {"--errors", ""}, {"--seeds", "5"}});
  if (arguments.scenarios.empty()) arguments.scenarios = {"euroc_v101", "tumvi_room1", "kitti_0013"};
  const std::string& runs = arguments.options.at("--runs");
  const OdometryErrors errors = odometry_errors(arguments.folder, runs, arguments.options.at("--errors"));
  for (const std::string& name : arguments.scenarios) {
    const std::string folder = fmt::format("{}/{}", arguments.options.at("--data"), name),
                      run_of_it = fmt::format("{}/{}", runs, name);
    if (name == "kitti_0013") {
      print_drive(open_kitti(folder, run_of_it), errors, 1, {true, true});
      continue;
    }
    const RealDrive d = name == "euroc_v101" ? open_euroc(folder, run_of_it) : open_tumvi(folder, run_of_it);
    print_drive(d, errors, arguments.number("--seeds"), {});
    print_gaps(d, errors, 1, 6, name == "euroc_v101" ? 1 : 10);
    if (name == "tumvi_room1") print_gaps(d, errors, 30, 20, 15);
  }
}

}  // namespace
}  // namespace spartan

int main(int argc, char** argv) {
  return spartan::run_benchmark(argc, argv, spartan::run);
}
