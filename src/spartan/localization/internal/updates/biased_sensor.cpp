#include "spartan/localization/internal/updates/biased_sensor.h"

#include "spartan/localization/internal/updates/filter_correction.h"

namespace spartan::internal {
namespace {

/// While a sensor is excluded, this fraction of each squared residual r² is added to the variance of its bias, so that
/// a sensor whose bias has changed permanently is readmitted: after n ≈ 30 readings, where fraction · n · r² exceeds r²
/// over the gate.
constexpr double kBiasFraction = 0.003;

}  // namespace

void correct_by_reading(FilterMemory& memory, const Innovation& innovation, const BiasedSensor& of,
                        const SensorGates& gates) {
  ErrorCovariance& p = memory.estimate.covariance;
  const double nis = normalized_innovation_squared(p, innovation);
  if (gates.accept(memory, of.sensor, nis, innovation.rows(), HealthReason::disagrees)) {
    if (memory.inertial_usable()) of.noise.add(p, innovation, of.stated_variance);
    correct_world(memory, innovation);
  } else if (memory.monitor(of.sensor).state == SensorState::excluded) {
    p.diagonal().segment(of.bias, innovation.rows()) += kBiasFraction * innovation.residual.cwiseAbs2();
  }
}

}  // namespace spartan::internal
