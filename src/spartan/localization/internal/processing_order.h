// The order in which a filter processes measurements.
#pragma once

#include <cmath>
#include <cstdint>
#include <variant>

#include "spartan/localization/localization_options.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {

/// Samples from so long before the start count for its alignment.
inline constexpr double kBeforeStart_s = 10;

/// A sample of the IMU gets its stamp by the clock of the cameras, as far as the options state the offset.
inline Measurement by_stated_clock(Measurement m, const InertialOptions& options) {
  if (auto* imu = std::get_if<ImuSample>(&m)) imu->stamp.ns -= std::llround(options.time_offset_s * 1e9);
  return m;
}

/// By stamps, then by kind; a sample of the IMU comes earlier by InertialOptions::max_time_error_s, because it may be
/// needed that long before its stamp.
class ProcessingOrder {
 public:
  explicit ProcessingOrder(const LocalizationOptions& options)
      : lead_ns_(std::llround(options.imu.max_time_error_s() * 1e9)) {}

  std::int64_t lead_ns() const { return lead_ns_; }
  /// When a measurement is processed.
  Stamp turn_of(const Measurement& m) const {
    const Stamp stamp = stamp_of_measurement(m);
    return std::holds_alternative<ImuSample>(m) ? Stamp{stamp.ns - lead_ns_} : stamp;
  }
  bool precedes(const Measurement& a, const Measurement& b) const {
    const Stamp at = turn_of(a), bt = turn_of(b);
    return at != bt ? at < bt : a.index() < b.index();
  }

 private:
  std::int64_t lead_ns_;
};

}  // namespace spartan::internal
