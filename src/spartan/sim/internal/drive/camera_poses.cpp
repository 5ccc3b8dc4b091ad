#include "spartan/sim/internal/drive/camera_poses.h"

#include <cmath>
#include <cstdint>

#include "spartan/numerics/random.h"
#include "spartan/sim/internal/drive/rover_seed.h"

namespace spartan::sim::internal {
namespace {

constexpr std::uint64_t kBiasStream = 350, kDriftStream = 360, kPositioningStream = 370;  // added to an index

}  // namespace

CameraPoses::CameraPoses(const Rig& true_rig, const RoverErrorOptions& errors, int scenario_seed, double drive_s)
    : rig_(true_rig),
      noise_rad_(errors.pan_tilt_noise_deg * kRadiansPerDegree),
      drive_s_(drive_s),
      seed_(rover_seed(errors, scenario_seed)) {
  for (std::size_t i = 0; i < rig_.pan_tilt_units.size(); ++i) {
    Random random(seed_, kBiasStream + i);
    const double sigma = errors.pan_tilt_bias_deg * kRadiansPerDegree;
    Angles& bias = bias_[rig_.pan_tilt_units[i].name];
    bias.pan_rad = random.normal(0, sigma);
    bias.tilt_rad = random.normal(0, sigma);
  }
  if (errors.drift_deg == 0) return;
  for (std::size_t i = 0; i < rig_.pairs.size(); ++i) {
    Random random(seed_, kDriftStream + i);
    Eigen::Vector3d& drift = drift_[rig_.pairs[i].right];
    for (double& angle : drift) angle = random.normal(0, errors.drift_deg * kRadiansPerDegree);
  }
}

CameraPoses::Angles CameraPoses::angles(const std::string& unit, const PlannedFrame& frame) const {
  const auto bias = bias_.find(unit);
  if (bias == bias_.end()) return {frame.pan_rad, frame.tilt_rad};
  // A positioning is known by its time, so that other frames of the drive do not change its error.
  Random random(seed_ + static_cast<std::uint64_t>(std::llround(frame.time_s * 1e6)), kPositioningStream);
  return {frame.pan_rad + bias->second.pan_rad + random.normal(0, noise_rad_),
          frame.tilt_rad + bias->second.tilt_rad + random.normal(0, noise_rad_)};
}

std::optional<Pose> CameraPoses::drift_of(const std::string& camera, double time_s) const {
  const auto drift = drift_.find(camera);
  if (drift == drift_.end()) return std::nullopt;
  return Pose::from_rotation(exp_so3(drift->second * (time_s / drive_s_)));
}

Pose CameraPoses::body_from_camera(const std::string& camera, const PlannedFrame& frame, double time_s) const {
  const Angles at = angles(rig_.find_camera(camera)->mount, frame);
  const Pose at_start = rig_.body_from_camera(camera, at.pan_rad, at.tilt_rad);
  const auto drift = drift_of(camera, time_s);
  return drift ? at_start * *drift : at_start;
}

}  // namespace spartan::sim::internal
