// Recordings with a real IMU and ground truth beyond their images.
#pragma once

#include <fmt/format.h>

#include <Eigen/QR>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "odometry_errors.h"
#include "spartan/calibration_io/calibration_files.h"
#include "spartan/core/files.h"
#include "spartan/localization/localizer.h"

namespace spartan {

/// Gap of the ground truth beyond which vision is lost.
inline constexpr double kMaxGap_s = 0.3;
struct RealDrive {
  std::string name;
  Rig rig;
  StereoPair pair;
  Pose body_from_left;
  SensorNoise noise;
  std::vector<ImuSample> imu;
  std::vector<WheelSample> wheels;
  std::vector<StampedPose> frames;  ///< world_from_body by the ground truth
  std::vector<bool> motion_known;   ///< false: the ground truth has a gap before the frame, vision is lost
  std::vector<MeasuredMotion> measured;
  double truth_sigma_m = 0, truth_sigma_rad = 0;  ///< of a motion by the ground truth, per axis
  Matrix6d covariance = Matrix6d::Zero();         ///< of a visual motion, left camera
  std::optional<InertialBiases> biases;           ///< by the reference after 5 s
  double length_m = 0;
};

// Local quadratic fit of position and rotation over ± half_s: the ground truth of TUM-VI is a motion capture system of
// 120 Hz without any smoothing, whose rotations scatter by 1 mrad.
inline std::optional<Pose> smoothed(const Trajectory& truth, Stamp at, double half_s) {
  const auto begin = std::partition_point(truth.begin(), truth.end(),
                                          [&](const auto& p) { return seconds_between(p.stamp, at) > half_s; });
  const auto end =
      std::partition_point(begin, truth.end(), [&](const auto& p) { return seconds_between(at, p.stamp) <= half_s; });
  const auto count = end - begin;
  if (count < 9 || begin->stamp > at || (end - 1)->stamp < at) return std::nullopt;
  Eigen::MatrixXd design(count, 3), values(count, 6);
  const Pose reference = (begin + count / 2)->pose;
  for (Eigen::Index i = 0; i < count; ++i) {
    const double t = seconds_between(at, (begin + i)->stamp);
    design.row(i) << 1, t, t * t;
    const Pose& pose = (begin + i)->pose;
    values.row(i) << (pose.translation() - reference.translation()).transpose(),
        log_so3(reference.rotation().conjugate() * pose.rotation()).transpose();
  }
  const Eigen::MatrixXd fit = design.colPivHouseholderQr().solve(values);
  const Eigen::RowVectorXd scatter =
      ((design * fit - values).colwise().squaredNorm() / static_cast<double>(count - 3)).cwiseSqrt();
  if (scatter.head<3>().maxCoeff() > 6e-4 || scatter.tail<3>().maxCoeff() > 3e-3) return std::nullopt;  // a glitch
  const Eigen::Matrix<double, 1, 6> at_zero = fit.row(0);
  return Pose(reference.rotation() * exp_so3(at_zero.tail<3>().transpose()),
              reference.translation() + at_zero.head<3>().transpose());
}

inline std::vector<ImuSample> all_imu(Recording& source) {
  auto samples = source.imu_samples({}, 1e6);
  if (!samples) throw std::runtime_error(samples.error().message());
  return *samples;
}

inline RealDrive open_drive(const std::string& name, const std::string& folder, const std::string& run) {
  auto source = open_recording(folder);
  if (!source) throw std::runtime_error(source.error().message());
  const auto motions = motions_of_run(run);
  if (!motions || motions->empty()) throw std::runtime_error(run + ": is no run of " + folder);
  RealDrive d;
  d.name = name;
  d.rig = (*source)->info().rig;
  d.pair = d.rig.pairs.front();
  d.noise = (*source)->info().noise;
  d.imu = all_imu(**source);
  d.measured = *motions;
  d.covariance = typical_covariance(*motions);
  d.body_from_left = d.rig.body_from_camera(d.pair.left);
  return d;
}

inline void add_frames(RealDrive& d, const Trajectory& truth, Stamp first, Stamp last, double period_s, double half_s) {
  for (Stamp at = first; at <= last; at.ns += static_cast<std::int64_t>(period_s * 1e9)) {
    // A frame without ground truth is left out: the next motion begins at the frame before.
    const std::optional<Pose> pose = smoothed(truth, at, half_s);
    if (!pose) continue;
    d.motion_known.push_back(d.frames.empty() || seconds_between(d.frames.back().stamp, at) < kMaxGap_s);
    d.frames.push_back({at, *pose});
    if (d.frames.size() > 1)
      d.length_m += (d.frames.back().pose.translation() - d.frames[d.frames.size() - 2].pose.translation()).norm();
  }
}

inline Trajectory load_truth(const std::string& file) {
  auto truth = load_trajectory(file);
  if (!truth) throw std::runtime_error(truth.error().message());
  return truth->poses;
}

// The columns of biases of EuRoC's ground truth, `seconds` after its begin.
inline InertialBiases reference_biases(const std::string& file, double seconds) {
  std::ifstream in(file);
  std::optional<double> first_ns;
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<double> v;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) v.push_back(std::stod(cell));
    if (v.size() < 17) continue;
    if (!first_ns) first_ns = v[0];
    if (v[0] - *first_ns < 1e9 * seconds) continue;
    InertialBiases biases;
    biases.gyro_rad_s = {v[11], v[12], v[13]};
    biases.accel_m_s2 = {v[14], v[15], v[16]};
    return biases;
  }
  throw std::runtime_error(file + ": is shorter");
}

inline RealDrive open_euroc(const std::string& folder, const std::string& run) {
  RealDrive d = open_drive("euroc_v101", folder, run);
  const std::string file = folder + "/mav0/state_groundtruth_estimate0/data.csv";
  const Trajectory truth = load_truth(file);
  for (const StampedPose& p : truth) {
    d.frames.push_back(p);
    d.motion_known.push_back(true);
    if (d.frames.size() > 1)
      d.length_m += (p.pose.translation() - d.frames[d.frames.size() - 2].pose.translation()).norm();
  }
  // Rotations differ from those by the gyro, without its bias, by 0.10 to 0.16 mrad, of which it explains 0.04.
  d.truth_sigma_rad = 1.2e-4;
  d.truth_sigma_m = 2e-4;
  d.biases = reference_biases(file, 5);
  return d;
}

inline RealDrive open_tumvi(const std::string& folder, const std::string& run) {
  RealDrive d = open_drive("tumvi_room1", folder, run);
  const Trajectory truth = load_truth(folder + "/truth.tum");
  add_frames(d, truth, d.measured.front().from, Stamp{truth.back().stamp.ns - 100'000'000}, 0.05, 0.045);
  d.truth_sigma_rad = 1.5e-3;
  d.truth_sigma_m = 3e-4;
  return d;
}

// OXTS rates and specific forces (10 Hz) as IMU, its forward speed as wheels; times of the text files.
inline std::int64_t nanoseconds_of_day(const std::string& text) {
  const auto at = text.find(' ') + 1;
  return (std::stoll(text.substr(at, 2)) * 3600 + std::stoll(text.substr(at + 3, 2)) * 60 +
          std::stoll(text.substr(at + 6, 2))) *
             1'000'000'000 +
         std::stoll(text.substr(at + 9, 9));
}
inline std::vector<std::int64_t> times_of(const std::string& file) {
  std::ifstream in(file);
  std::vector<std::int64_t> times;
  for (std::string line; std::getline(in, line);) {
    if (line.size() > 20) times.push_back(nanoseconds_of_day(line));
  }
  return times;
}

inline RealDrive open_kitti(const std::string& folder, const std::string& run) {
  const auto motions = motions_of_run(run);
  const auto rig = read_kitti_raw_calib(folder + "/calib_cam_to_cam.txt");
  if (!motions || !rig) throw std::runtime_error(folder + ": no run of it, or no raw calibration");
  RealDrive d;
  d.name = "kitti_0013";
  d.rig = *rig;
  d.pair = d.rig.pairs.front();
  d.body_from_left = d.rig.body_from_camera(d.pair.left);
  d.measured = *motions;
  d.covariance = typical_covariance(*motions);
  const std::string poses_file = folder + "/poses_imu_all144.txt";
  const auto truth = parse_kitti(read_file(poses_file).value_or(""), poses_file, {});
  if (!truth) throw std::runtime_error(truth.error().message());
  const auto oxts = times_of(folder + "/oxts/timestamps.txt"), images = times_of(folder + "/timestamps_image_00.txt");
  double rolled = 0, before_s = 0, before_speed = 0;
  for (std::size_t i = 0; i < oxts.size(); ++i) {
    std::ifstream in(fmt::format("{}/oxts/data/{:010}.txt", folder, i));
    std::vector<double> v(30);
    for (double& x : v) in >> x;
    if (!in) break;
    const Stamp at{motions->front().from.ns + oxts[i] - images[0]};
    d.imu.push_back({at, {v[17], v[18], v[19]}, {v[11], v[12], v[13]}});
    const double now_s = 1e-9 * static_cast<double>(at.ns), speed = v[8];
    if (i > 0) rolled += 0.5 * (speed + before_speed) * (now_s - before_s);
    before_s = now_s;
    before_speed = speed;
    d.wheels.push_back({at, rolled, rolled});
  }
  d.frames.push_back({motions->front().from, truth->front().pose});
  for (std::size_t i = 0; i < motions->size(); ++i) d.frames.push_back({(*motions)[i].to, truth->at(i + 1).pose});
  d.motion_known.assign(d.frames.size(), true);
  for (std::size_t i = 1; i < d.frames.size(); ++i)
    d.length_m += (d.frames[i].pose.translation() - d.frames[i - 1].pose.translation()).norm();
  return d;
}

}  // namespace spartan
