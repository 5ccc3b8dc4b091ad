#include <cmath>

#include "spartan/localization/localizer.h"

namespace spartan {
namespace {

bool valid(const ImuSample& s) {
  return s.gyro_rad_s.allFinite() && s.accel_m_s2.allFinite();
}
bool valid(const WheelSample& s) {
  return std::isfinite(s.left_m) && std::isfinite(s.right_m);
}
bool valid(const CompassSample& s) {
  return std::isfinite(s.heading_rad) && std::isfinite(s.sigma_rad);
}
bool valid(const InclinometerSample& s) {
  return std::isfinite(s.roll_rad) && std::isfinite(s.pitch_rad) && std::isfinite(s.sigma_rad);
}
bool valid(const RelativeMotion& m) {
  if (!m.measured) return true;
  return m.previous_from_current.all_finite() && m.covariance.allFinite() && m.by_calibration.allFinite() &&
         (!m.lasting_sigma || (m.lasting_sigma->array() >= 0).all()) && (m.covariance.diagonal().array() >= 0).all();
}
bool valid(const PoseConstraint& c) {
  return c.world_from_body.all_finite() && c.information.allFinite() && c.map_covariance.allFinite() &&
         (c.information.diagonal().array() >= 0).all() && (c.map_covariance.diagonal().array() >= 0).all();
}
bool valid(const LateConstraint& c) {
  return valid(c.at_frame);
}

}  // namespace

Matrix6d RelativeMotion::own_covariance() const {
  Matrix6d own = covariance - by_calibration * by_calibration.transpose();
  own.diagonal() = own.diagonal().cwiseMax(0);
  return own;
}

Vector6d RelativeMotion::drift_scale() const {
  if (is_stationary()) return Vector6d::Zero();
  return lasting_sigma ? *lasting_sigma : own_covariance().diagonal().cwiseSqrt();
}

bool RelativeMotion::is_stationary() const {
  return previous_from_current.translation().isZero(1e-12) && previous_from_current.rotation().vec().isZero(1e-12);
}

LocalizationSensor sensor_of(const Measurement& m) {
  constexpr LocalizationSensor kOfIndex[] = {LocalizationSensor::imu,          LocalizationSensor::vision,
                                             LocalizationSensor::wheels,       LocalizationSensor::compass,
                                             LocalizationSensor::inclinometer, LocalizationSensor::map,
                                             LocalizationSensor::map};
  return kOfIndex[m.index()];
}

bool is_valid(const Measurement& m) {
  return std::visit([](const auto& value) { return valid(value); }, m);
}

}  // namespace spartan
