#include "spartan/localization/measurement.h"

#include <cmath>

namespace spartan {
namespace {

bool sound(const ImuSample& s) {
  return s.gyro_rad_s.allFinite() && s.accel_m_s2.allFinite();
}
bool sound(const WheelSample& s) {
  return std::isfinite(s.left_m) && std::isfinite(s.right_m);
}
bool sound(const CompassSample& s) {
  return std::isfinite(s.heading_rad) && std::isfinite(s.sigma_rad);
}
bool sound(const InclinometerSample& s) {
  return std::isfinite(s.roll_rad) && std::isfinite(s.pitch_rad) && std::isfinite(s.sigma_rad);
}
bool sound(const RelativeMotion& m) {
  if (!m.measured) return true;
  return m.previous_from_current.all_finite() && m.covariance.allFinite() &&
         (m.covariance.diagonal().array() >= 0).all();
}
bool sound(const PoseConstraint& c) {
  return c.world_from_body.all_finite() && c.information.allFinite() && c.map_covariance.allFinite() &&
         (c.information.diagonal().array() >= 0).all() && (c.map_covariance.diagonal().array() >= 0).all();
}
bool sound(const LateConstraint& c) {
  return sound(c.at_shot);
}

}  // namespace

LocalizationSensor sensor_of(const Measurement& m) {
  constexpr LocalizationSensor kOfIndex[] = {LocalizationSensor::imu,          LocalizationSensor::vision,
                                             LocalizationSensor::wheels,       LocalizationSensor::compass,
                                             LocalizationSensor::inclinometer, LocalizationSensor::map,
                                             LocalizationSensor::map};
  return kOfIndex[m.index()];
}

bool is_sound(const Measurement& m) {
  return std::visit([](const auto& value) { return sound(value); }, m);
}

}  // namespace spartan
