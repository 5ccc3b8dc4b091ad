// Compass, inclinometer and map: what is measured against the world.
#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/error_state_filter.h"
#include "spartan/localization/internal/kalman_update.h"
#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/start_frame.h"

namespace spartan {
namespace {

/// While a sensor is excluded the variance of its own bias takes up this share of each squared disagreement, so that
/// one that has changed for good comes back: after some 30 readings (share · n · r² exceeds r² over the gate).
constexpr double kBiasShare = 0.003;
/// So many compass readings share the error that an unknown vertical makes.
constexpr double kReadingsOfOneLean = 100;
/// Squares over their degrees of freedom: 5 % of the readings are so much off, and most that is put down to rocking.
constexpr double kSurprise = 3, kMostRocking = 15;

}  // namespace

void ErrorStateFilter::take(const CompassSample& sample) {
  move_to(sample.stamp, nullptr);
  // A vertical that is only known to σ² turns headings by up to ½ σ², always to the same side.
  const double lean = 0.5 * memory_.belief.covariance.diagonal().segment<2>(error_at::kGravityTilt).sum();
  const double sigma =
      std::hypot(std::max(sample.sigma_rad, options_.compass.least_sigma_rad), std::sqrt(kReadingsOfOneLean) * lean);
  if (!memory_.compass.offset_known) {
    find_compass_offset(sample, sigma);
    return;
  }
  const Innovation innovation = compass_innovation(memory_.belief.state, sample.heading_rad, sigma);
  const double square = normalised_square(memory_.belief.covariance, innovation);
  const bool use = judge(LocalizationSensor::compass, square, 1, HealthReason::disagrees);
  if (use) {
    correct_world(innovation);
  } else if (memory_.judge(LocalizationSensor::compass).state == SensorState::excluded) {
    memory_.belief.covariance(error_at::kCompassOffset, error_at::kCompassOffset) +=
        kBiasShare * innovation.residual.squaredNorm();
  }
}

/// A compass that starts during the drive: its offset is that on which most of the first readings agree.
void ErrorStateFilter::find_compass_offset(const CompassSample& sample, double sigma) {
  CompassMemory& compass = memory_.compass;
  compass.offsets[compass.pending] = sample.heading_rad - heading_about_up(memory_.belief.state);
  compass.sigmas[compass.pending] = sigma;
  if (++compass.pending < CompassMemory::kPending) return;
  std::array<CompassSample, CompassMemory::kPending> readings;
  for (std::size_t i = 0; i < readings.size(); ++i) readings[i] = {{}, compass.offsets[i], compass.sigmas[i]};
  const auto offset = agreed_heading(readings, options_.compass.least_sigma_rad);
  if (!offset) {  // the oldest goes, the next one may decide
    std::rotate(compass.offsets.begin(), compass.offsets.begin() + 1, compass.offsets.end());
    std::rotate(compass.sigmas.begin(), compass.sigmas.begin() + 1, compass.sigmas.end());
    --compass.pending;
    return;
  }
  compass.pending = 0;
  compass.offset_known = true;
  NavigationState& s = memory_.belief.state;
  s.compass_offset_rad = offset->radians;
  correct_world(compass_innovation(s, heading_about_up(s) + offset->radians,
                                   std::hypot(offset->sigma_rad, options_.compass.offset_sigma_rad)));
  ++memory_.judge(LocalizationSensor::compass).used;
}

void ErrorStateFilter::take(const InclinometerSample& sample) {
  move_to(sample.stamp, nullptr);
  const double sigma =
      options_.inclinometer.noise_factor * std::max(sample.sigma_rad, options_.inclinometer.least_sigma_rad);
  NavigationState& s = memory_.belief.state;
  if (!memory_.imu.levelled) {
    const Eigen::Vector3d up = s.world_from_body.rotation() * up_of_roll_pitch(sample.roll_rad, sample.pitch_rad);
    if (up.z() <= 0) return;
    s.gravity_tilt_rad = tilt_of_up(up);
    memory_.imu.levelled = true;
  }
  const Innovation innovation = inclinometer_innovation(s, sample.roll_rad, sample.pitch_rad, sigma);
  allow_for_rocking(innovation);
  const double square = normalised_square(memory_.belief.covariance, innovation);
  const bool use = judge(LocalizationSensor::inclinometer, square, 2, HealthReason::disagrees);
  if (use) {
    correct_world(innovation);
  } else if (memory_.judge(LocalizationSensor::inclinometer).state == SensorState::excluded) {
    memory_.belief.covariance.diagonal().segment<2>(error_at::kInclinometerBias) +=
        kBiasShare * innovation.residual.cwiseAbs2();
  }
}

/// Between shots, without an IMU, a reading that surprises tells first of all that the rover rocks more than most
/// times: the attitude's noise since the last shot grows until the surprise is an ordinary one.
void ErrorStateFilter::allow_for_rocking(const Innovation& innovation) {
  if (!(memory_.vision.unmeasured_s > 0)) return;
  const double surprise =
      normalised_square(memory_.belief.covariance, innovation) / static_cast<double>(innovation.rows());
  if (surprise < kSurprise) return;
  memory_.belief.covariance.block<3, 3>(error_at::kAttitude, error_at::kAttitude) +=
      std::min(surprise - 1, kMostRocking) *
      memory_.vision.unmeasured_noise.block<3, 3>(error_at::kAttitude, error_at::kAttitude);
}

void ErrorStateFilter::take(const PoseConstraint& constraint) {
  move_to(constraint.stamp, nullptr);
  hear_map(constraint, error_at::kPose);
}

void ErrorStateFilter::take(const LateConstraint& constraint) {
  move_to(constraint.stamp, nullptr);
  if (constraint.at_shot.stamp == memory_.vision.clone_stamp) hear_map(constraint.at_shot, error_at::kVisionClone);
}

void ErrorStateFilter::hear_map(const PoseConstraint& constraint, int pose) {
  const Innovation innovation = map_innovation(memory_.belief, pose, constraint, options_.map_factor);
  if (innovation.rows() == 0) return;
  const double square = normalised_square(memory_.belief.covariance, innovation);
  if (judge(LocalizationSensor::map, square, innovation.rows(), HealthReason::disagrees)) correct_by_map(innovation);
}

}  // namespace spartan
