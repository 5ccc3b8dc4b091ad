#include "spartan/localization/internal/updates/compass_update.h"

#include <algorithm>
#include <cmath>

#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/internal/updates/biased_sensor.h"
#include "spartan/localization/internal/updates/filter_correction.h"

namespace spartan::internal {
namespace {

/// Number of compass readings that share the heading error by an uncertain vertical.
constexpr double kReadingsPerTiltError = 100;

}  // namespace

void CompassUpdate::update(FilterMemory& memory, const CompassSample& sample) const {
  // A vertical of variance σ² biases headings by up to ½ σ², always in the same direction.
  const double tilt_bias = 0.5 * memory.estimate.covariance.diagonal().segment<2>(error_at::kGravityTilt).sum();
  NoiseRatio& noise = memory.compass.noise;
  const double stated = std::max(sample.sigma_rad, options_.min_sigma_rad);
  const double sigma = std::hypot(stated * std::sqrt(noise.factor()), std::sqrt(kReadingsPerTiltError) * tilt_bias);
  if (!memory.compass.offset_known) {
    initialize_offset(memory, sample, sigma);
    return;
  }
  correct_by_reading(memory, compass_innovation(memory.estimate.state, sample.heading_rad, sigma),
                     {LocalizationSensor::compass, error_at::kCompassOffset, stated * stated, noise}, gates_);
}

void CompassUpdate::initialize_offset(FilterMemory& memory, const CompassSample& sample, double sigma_rad) const {
  CompassMemory& compass = memory.compass;
  compass.offsets[compass.pending] = sample.heading_rad - heading_about_up(memory.estimate.state);
  compass.sigmas[compass.pending] = sigma_rad;
  if (++compass.pending < CompassMemory::kPending) return;
  std::array<CompassSample, CompassMemory::kPending> readings;
  for (std::size_t i = 0; i < readings.size(); ++i) readings[i] = {{}, compass.offsets[i], compass.sigmas[i]};
  const auto offset = consensus_heading(readings, options_.min_sigma_rad);
  if (!offset) {  // no consensus: discard the oldest reading and wait for the next
    std::rotate(compass.offsets.begin(), compass.offsets.begin() + 1, compass.offsets.end());
    std::rotate(compass.sigmas.begin(), compass.sigmas.begin() + 1, compass.sigmas.end());
    --compass.pending;
    return;
  }
  compass.pending = 0;
  compass.offset_known = true;
  NavigationState& s = memory.estimate.state;
  s.compass_offset_rad = offset->radians;
  correct_world(memory, compass_innovation(s, heading_about_up(s) + offset->radians,
                                           std::hypot(offset->sigma_rad, options_.offset_sigma_rad)));
  ++memory.monitor(LocalizationSensor::compass).used;
}

}  // namespace spartan::internal
