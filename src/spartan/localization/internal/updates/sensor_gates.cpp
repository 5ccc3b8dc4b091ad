#include "spartan/localization/internal/updates/sensor_gates.h"

#include "spartan/localization/internal/chi_square.h"

namespace spartan::internal {

SensorGates::SensorGates(const LocalizationOptions& options)
    : excluded_after_(options.health.excluded_after), readmit_after_(options.health.readmit_after) {
  for (int rows = 1; rows <= 6; ++rows)
    limits_.by_rows[static_cast<std::size_t>(rows)] = chi_square_quantile(options.health.gate_probability, rows);
  limits_.vision = chi_square_quantile(options.vision.gate_probability, 6);
}

bool SensorGates::accept(SensorMonitor& monitor, double nis, int rows, HealthReason why) const {
  return accept_within(monitor, nis, limit(rows), why);
}

bool SensorGates::accept_within(SensorMonitor& monitor, double nis, double limit, HealthReason why) const {
  return monitor.accept(nis, limit, why, excluded_after_, readmit_after_);
}

}  // namespace spartan::internal
