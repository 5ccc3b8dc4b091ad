#include "spartan/localization/internal/updates/sensor_gates.h"

#include <cmath>
#include <limits>

#include "spartan/localization/internal/chi_square.h"

namespace spartan::internal {
namespace {

// Infinite or no number where the covariance of the innovation is singular.
double finite(double nis) {
  return std::isfinite(nis) ? nis : std::numeric_limits<double>::max();
}

}  // namespace

SensorGates::SensorGates(const LocalizationOptions& options)
    : excluded_after_(options.health.excluded_after), readmit_after_(options.health.readmit_after) {
  for (int rows = 1; rows <= 6; ++rows)
    limits_.by_rows[static_cast<std::size_t>(rows)] = chi_square_quantile(options.health.gate_probability, rows);
  limits_.vision = chi_square_quantile(options.vision.gate_probability, 6);
}

bool SensorGates::accept(FilterMemory& memory, LocalizationSensor sensor, double nis, int rows,
                         HealthReason why) const {
  return accept_within(memory, sensor, nis, limit(rows), why);
}

bool SensorGates::accept_within(FilterMemory& memory, LocalizationSensor sensor, double nis, double limit,
                                HealthReason why) const {
  SensorMonitor& monitor = memory.monitor(sensor);
  monitor.test = InnovationTest{memory.stamp, finite(nis), limit};
  return count(monitor, nis, limit, why);
}

bool SensorGates::accept_motion(FilterMemory& memory, const MotionDecision& decision,
                                std::optional<double> tested) const {
  SensorMonitor& monitor = memory.monitor(LocalizationSensor::vision);
  monitor.test.reset();
  if (tested) monitor.test = InnovationTest{memory.stamp, finite(*tested), limits_.vision};
  return count(monitor, decision.nis, decision.gate, decision.why);
}

bool SensorGates::count(SensorMonitor& monitor, double nis, double limit, HealthReason why) const {
  return monitor.accept(finite(nis), limit, why, excluded_after_, readmit_after_);
}

}  // namespace spartan::internal
