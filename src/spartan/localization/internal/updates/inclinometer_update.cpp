#include "spartan/localization/internal/updates/inclinometer_update.h"

#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/updates/biased_sensor.h"

namespace spartan::internal {
namespace {

/// Normalized innovation squared per degree of freedom: the threshold that 5 % of the readings exceed, and the largest
/// factor by which rocking inflates the attitude noise.
constexpr double kRockingThreshold = 3, kMaxRockingFactor = 15;

/// Between frames, without an IMU, a large innovation is most likely due to rocking of the rover: the attitude noise
/// accumulated since the last frame is inflated until the innovation is consistent with it.
void inflate_attitude(FilterMemory& memory, const Innovation& innovation) {
  if (!(memory.vision.constant_velocity_s > 0)) return;
  const double ratio =
      normalized_innovation_squared(memory.estimate.covariance, innovation) / static_cast<double>(innovation.rows());
  if (ratio < kRockingThreshold) return;
  memory.estimate.covariance.block<3, 3>(error_at::kAttitude, error_at::kAttitude) +=
      std::min(ratio - 1, kMaxRockingFactor) *
      memory.vision.constant_velocity_noise.block<3, 3>(error_at::kAttitude, error_at::kAttitude);
}

}  // namespace

double stated_sigma(const TiltOptions& options, const InclinometerSample& sample) {
  return options.noise_factor * std::max(sample.sigma_rad, options.min_sigma_rad);
}

void InclinometerUpdate::update(FilterMemory& memory, const InclinometerSample& sample) const {
  memory.inclinometer.known = true;
  memory.inclinometer.last = sample;
  NoiseRatio& noise = memory.inclinometer.noise;
  const double stated = stated_sigma(options_, sample);
  // Without an IMU, the visual motions have measured the noise of the readings and the rocking between them.
  const double factor =
      memory.inertial_usable() ? noise.factor() : std::max(1.0, memory.inclinometer.of_motions.factor());
  const double sigma = stated * std::sqrt(factor);
  NavigationState& s = memory.estimate.state;
  if (!memory.gravity_known) {
    const Eigen::Vector3d up = s.world_from_body.rotation() * up_of_roll_pitch(sample.roll_rad, sample.pitch_rad);
    if (up.z() <= 0) return;
    s.gravity_tilt_rad = tilt_of_up(up);
    memory.gravity_known = true;
  }
  const Innovation innovation = inclinometer_innovation(s, sample.roll_rad, sample.pitch_rad, sigma);
  inflate_attitude(memory, innovation);
  correct_by_reading(memory, innovation,
                     {LocalizationSensor::inclinometer, error_at::kInclinometerBias, stated * stated, noise}, gates_);
}

}  // namespace spartan::internal
