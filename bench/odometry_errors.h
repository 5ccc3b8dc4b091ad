// Errors of visual odometry as measured on rendered drives, to be added to motions that are known.
#pragma once

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/core/trajectory.h"
#include "spartan/numerics/random.h"
#include "spartan/odometry/odometer.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// The pose nearest in time; `poses` must not be empty.
inline const StampedPose& pose_near(const Trajectory& poses, Stamp stamp) {
  return *std::min_element(poses.begin(), poses.end(), [&](const auto& a, const auto& b) {
    return std::abs(a.stamp.ns - stamp.ns) < std::abs(b.stamp.ns - stamp.ns);
  });
}

/// A motion of the left camera as a run measured it.
struct MeasuredMotion {
  Stamp from, to;
  Pose previous_from_current;
  Matrix6d covariance;
  bool measured = true;
};

/// The motions of a finished run; nothing if it cannot be read.
inline std::optional<std::vector<MeasuredMotion>> motions_of_run(const std::string& run) {
  auto store = RunStore::open_read_only(run + "/run.sqlite");
  if (!store) return std::nullopt;
  const auto frames = store->frames();
  if (!frames) return std::nullopt;
  std::vector<MeasuredMotion> motions;
  for (const FrameRecord& f : *frames) {
    if (!f.fault.empty() || f.motion.first) continue;
    motions.push_back({f.motion.from, f.motion.to, f.motion.previous_from_current, f.motion.covariance,
                       f.status != name_of(TrackingStatus::lost)});
  }
  return motions;
}

/// Covariance of a typical motion: medians of the standard deviations, means of the correlations.
inline Matrix6d typical_covariance(const std::vector<MeasuredMotion>& motions) {
  Matrix6d correlation = Matrix6d::Zero();
  Vector6d sigmas;
  for (int i = 0; i < 6; ++i) {
    std::vector<double> values;
    values.reserve(motions.size());
    for (const MeasuredMotion& m : motions) values.push_back(std::sqrt(m.covariance(i, i)));
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    sigmas[i] = values[values.size() / 2];
  }
  int count = 0;
  for (const MeasuredMotion& m : motions) {
    const Vector6d inverse = m.covariance.diagonal().cwiseSqrt().cwiseInverse();
    if (!inverse.allFinite()) continue;
    correlation += inverse.asDiagonal() * m.covariance * inverse.asDiagonal();
    ++count;
  }
  return sigmas.asDiagonal() * (correlation / count) * sigmas.asDiagonal();
}

/// Errors of consecutive motions of one drive, whitened: L⁻¹ e with the Cholesky factor L of the reported covariance.
using WhitenedErrors = std::vector<Vector6d>;

/// Of a run of a recording with ground truth whose rig is exact (motions of stationary cameras are left out). Nothing
/// if they cannot be read.
inline std::optional<WhitenedErrors> whitened_errors(const std::string& recording, const std::string& run) {
  const auto source = open_recording(recording);
  const auto motions = motions_of_run(run);
  const auto poses = load_trajectory(recording + "/truth/poses.tum");
  if (!source || !motions || !poses) return std::nullopt;
  const Rig& rig = (*source)->info().rig;
  const auto pair = std::find_if(rig.pairs.begin(), rig.pairs.end(), [](const auto& p) { return p.for_odometry; });
  if (pair == rig.pairs.end()) return std::nullopt;
  const Pose body_from_left = rig.body_from_camera(pair->left);
  WhitenedErrors errors;
  for (const MeasuredMotion& m : *motions) {
    if (!m.measured || m.previous_from_current.translation().isZero(1e-12)) continue;
    const Pose from = pose_near(poses->poses, m.from).pose * body_from_left,
               to = pose_near(poses->poses, m.to).pose * body_from_left;
    const Vector6d error = log_se3((from.inverse() * to).inverse() * m.previous_from_current);
    errors.push_back(m.covariance.llt().matrixL().solve(error));
  }
  return errors;
}

/// A sequence of errors for the motions of another drive: the measured ones in their order, from a random place of a
/// random drive on, so that their correlation in time is kept.
class OdometryErrors {
 public:
  explicit OdometryErrors(std::vector<WhitenedErrors> drives) : drives_(std::move(drives)) {}

  WhitenedErrors draw(std::size_t count, std::uint64_t seed) const {
    Random random(seed, 501);
    WhitenedErrors errors;
    errors.reserve(count);
    while (errors.size() < count) {
      const WhitenedErrors& drive = drives_[random.below(static_cast<std::uint32_t>(drives_.size()))];
      for (std::size_t i = random.below(static_cast<std::uint32_t>(drive.size()));
           i < drive.size() && errors.size() < count; ++i)
        errors.push_back(drive[i]);
    }
    return errors;
  }

 private:
  std::vector<WhitenedErrors> drives_;
};

/// The parts of a list with commas.
inline std::vector<std::string> split(const std::string& list) {
  std::vector<std::string> names;
  std::stringstream in(list);
  for (std::string name; std::getline(in, name, ',');) names.push_back(name);
  return names;
}

/// Of the recordings folder/NAME with the runs runs/NAME, for each NAME of a list with commas. Throws
/// std::runtime_error.
inline OdometryErrors odometry_errors(const std::string& folder, const std::string& runs, const std::string& list) {
  std::vector<WhitenedErrors> drives;
  for (const std::string& name : split(list)) {
    auto errors = whitened_errors(fmt::format("{}/{}", folder, name), fmt::format("{}/{}", runs, name));
    if (!errors || errors->empty())
      throw std::runtime_error(name + ": there is no recording with ground truth, or no run");
    drives.push_back(std::move(*errors));
  }
  if (drives.empty()) throw std::runtime_error("--errors: names no rendered drives");
  return OdometryErrors(std::move(drives));
}

}  // namespace spartan
