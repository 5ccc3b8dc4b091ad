// Absolute measurements: updates by compass, inclinometer and map.
#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/error_state_filter.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {
namespace {

/// While a sensor is excluded, this fraction of each squared residual r² is added to the variance of its bias, so that
/// a sensor whose bias has changed permanently is readmitted: after n ≈ 30 readings, where fraction · n · r² exceeds r²
/// over the gate.
constexpr double kBiasFraction = 0.003;
/// Number of compass readings that share the heading error by an uncertain vertical.
constexpr double kReadingsPerTiltError = 100;
/// Normalized innovation squared per degree of freedom: the threshold that 5 % of the readings exceed, and the largest
/// factor by which rocking inflates the attitude noise.
constexpr double kRockingThreshold = 3, kMaxRockingFactor = 15;

}  // namespace

void ErrorStateFilter::update(const CompassSample& sample) {
  advance_to(sample.stamp);
  // A vertical of variance σ² biases headings by up to ½ σ², always in the same direction.
  const double tilt_bias = 0.5 * memory_.estimate.covariance.diagonal().segment<2>(error_at::kGravityTilt).sum();
  NoiseRatio& noise = memory_.compass.noise;
  const double stated = std::max(sample.sigma_rad, options_.compass.min_sigma_rad);
  const double sigma = std::hypot(stated * std::sqrt(noise.factor()), std::sqrt(kReadingsPerTiltError) * tilt_bias);
  if (!memory_.compass.offset_known) {
    initialize_compass_offset(sample, sigma);
    return;
  }
  const Innovation innovation = compass_innovation(memory_.estimate.state, sample.heading_rad, sigma);
  const double nis = normalized_innovation_squared(memory_.estimate.covariance, innovation);
  const bool use = accept(LocalizationSensor::compass, nis, 1, HealthReason::disagrees);
  if (use) {
    if (inertial_usable()) noise.add(memory_.estimate.covariance, innovation, stated * stated);
    correct_world(innovation);
  } else if (memory_.monitor(LocalizationSensor::compass).state == SensorState::excluded) {
    memory_.estimate.covariance(error_at::kCompassOffset, error_at::kCompassOffset) +=
        kBiasFraction * innovation.residual.squaredNorm();
  }
}

/// A compass that starts during the drive: its offset is the consensus of the first readings.
void ErrorStateFilter::initialize_compass_offset(const CompassSample& sample, double sigma) {
  CompassMemory& compass = memory_.compass;
  compass.offsets[compass.pending] = sample.heading_rad - heading_about_up(memory_.estimate.state);
  compass.sigmas[compass.pending] = sigma;
  if (++compass.pending < CompassMemory::kPending) return;
  std::array<CompassSample, CompassMemory::kPending> readings;
  for (std::size_t i = 0; i < readings.size(); ++i) readings[i] = {{}, compass.offsets[i], compass.sigmas[i]};
  const auto offset = consensus_heading(readings, options_.compass.min_sigma_rad);
  if (!offset) {  // no consensus: discard the oldest reading and wait for the next
    std::rotate(compass.offsets.begin(), compass.offsets.begin() + 1, compass.offsets.end());
    std::rotate(compass.sigmas.begin(), compass.sigmas.begin() + 1, compass.sigmas.end());
    --compass.pending;
    return;
  }
  compass.pending = 0;
  compass.offset_known = true;
  NavigationState& s = memory_.estimate.state;
  s.compass_offset_rad = offset->radians;
  correct_world(compass_innovation(s, heading_about_up(s) + offset->radians,
                                   std::hypot(offset->sigma_rad, options_.compass.offset_sigma_rad)));
  ++memory_.monitor(LocalizationSensor::compass).used;
}

double ErrorStateFilter::stated_sigma(const InclinometerSample& sample) const {
  return options_.inclinometer.noise_factor * std::max(sample.sigma_rad, options_.inclinometer.min_sigma_rad);
}

void ErrorStateFilter::update(const InclinometerSample& sample) {
  advance_to(sample.stamp);
  memory_.inclinometer.known = true;
  memory_.inclinometer.last = sample;
  NoiseRatio& noise = memory_.inclinometer.noise;
  const double stated = stated_sigma(sample);
  // Without an IMU, the visual motions have measured the noise of the readings and the rocking between them.
  const double factor = inertial_usable() ? noise.factor() : std::max(1.0, memory_.inclinometer.of_motions.factor());
  const double sigma = stated * std::sqrt(factor);
  NavigationState& s = memory_.estimate.state;
  if (!memory_.gravity_known) {
    const Eigen::Vector3d up = s.world_from_body.rotation() * up_of_roll_pitch(sample.roll_rad, sample.pitch_rad);
    if (up.z() <= 0) return;
    s.gravity_tilt_rad = tilt_of_up(up);
    memory_.gravity_known = true;
  }
  const Innovation innovation = inclinometer_innovation(s, sample.roll_rad, sample.pitch_rad, sigma);
  inflate_attitude(innovation);
  const double nis = normalized_innovation_squared(memory_.estimate.covariance, innovation);
  const bool use = accept(LocalizationSensor::inclinometer, nis, 2, HealthReason::disagrees);
  if (use) {
    if (inertial_usable()) noise.add(memory_.estimate.covariance, innovation, stated * stated);
    correct_world(innovation);
  } else if (memory_.monitor(LocalizationSensor::inclinometer).state == SensorState::excluded) {
    memory_.estimate.covariance.diagonal().segment<2>(error_at::kInclinometerBias) +=
        kBiasFraction * innovation.residual.cwiseAbs2();
  }
}

/// Between frames, without an IMU, a large innovation is most likely due to rocking of the rover: the attitude noise
/// accumulated since the last frame is inflated until the innovation is consistent with it.
void ErrorStateFilter::inflate_attitude(const Innovation& innovation) {
  if (!(memory_.vision.constant_velocity_s > 0)) return;
  const double ratio =
      normalized_innovation_squared(memory_.estimate.covariance, innovation) / static_cast<double>(innovation.rows());
  if (ratio < kRockingThreshold) return;
  memory_.estimate.covariance.block<3, 3>(error_at::kAttitude, error_at::kAttitude) +=
      std::min(ratio - 1, kMaxRockingFactor) *
      memory_.vision.constant_velocity_noise.block<3, 3>(error_at::kAttitude, error_at::kAttitude);
}

void ErrorStateFilter::update(const PoseConstraint& constraint) {
  advance_to(constraint.stamp);
  apply_constraint(constraint, error_at::kPose);
}

void ErrorStateFilter::update(const LateConstraint& constraint) {
  advance_to(constraint.stamp);
  if (constraint.at_frame.stamp == memory_.vision.clone_stamp)
    apply_constraint(constraint.at_frame, error_at::kVisionClone);
}

void ErrorStateFilter::apply_constraint(const PoseConstraint& of_body, int pose) {
  const PoseConstraint constraint = arm_.imu_constraint(of_body);
  const Innovation innovation = map_innovation(memory_.estimate, pose, constraint, options_.map_factor);
  if (innovation.rows() == 0) return;
  const double nis = normalized_innovation_squared(memory_.estimate.covariance, innovation);
  if (accept(LocalizationSensor::map, nis, innovation.rows(), HealthReason::disagrees)) correct_by_map(innovation);
}

}  // namespace spartan::internal
