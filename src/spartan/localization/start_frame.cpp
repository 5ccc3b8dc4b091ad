#include <algorithm>
#include <cmath>
#include <numbers>

#include "spartan/localization/internal/measurement_models.h"
#include "spartan/localization/localizer.h"

namespace spartan {

using namespace internal;

namespace {

constexpr std::size_t kMinSamples = 10;
/// Largest deviation of the mean specific force and largest scatter, over gravity.
constexpr double kMaxGravityError = 0.05, kMaxScatter = 0.10;

double wrapped(double angle) {
  return std::remainder(angle, 2 * std::numbers::pi);
}

}  // namespace

std::optional<StaticReading> static_reading(std::span<const ImuSample> samples, const LocalizationOptions& o) {
  Eigen::Vector3d gyro = Eigen::Vector3d::Zero(), accel = gyro, gyro_squares = gyro, accel_squares = gyro;
  double count = 0;
  for (const ImuSample& s : samples) {
    if (!s.accel_m_s2.allFinite() || !s.gyro_rad_s.allFinite()) continue;
    gyro += s.gyro_rad_s;
    accel += s.accel_m_s2;
    gyro_squares += s.gyro_rad_s.cwiseAbs2();
    accel_squares += s.accel_m_s2.cwiseAbs2();
    ++count;
  }
  if (count < static_cast<double>(kMinSamples)) return std::nullopt;
  StaticReading r;
  r.gyro_rad_s = gyro / count;
  r.accel_m_s2 = accel / count;
  const auto scatter = [&](const Eigen::Vector3d& squares, const Eigen::Vector3d& mean) {
    return std::sqrt((squares / count - mean.cwiseAbs2()).cwiseMax(0).maxCoeff());
  };
  const double accel_scatter = scatter(accel_squares, r.accel_m_s2), gyro_scatter = scatter(gyro_squares, r.gyro_rad_s);
  if (std::abs(r.accel_m_s2.norm() - o.gravity_m_s2) > kMaxGravityError * o.gravity_m_s2) return std::nullopt;
  if (accel_scatter > kMaxScatter * o.gravity_m_s2) return std::nullopt;
  const double seconds = std::max(seconds_between(samples.front().stamp, samples.back().stamp), 1e-3);
  const double interval = seconds / count, gyro_limit = o.imu.stationary_gyro(interval);
  // By the scatter: the mean of a stationary gyro is its bias, which has no limit but its standard deviation.
  r.stationary = accel_scatter < o.imu.stationary_accel(interval) && gyro_scatter < gyro_limit &&
                 r.gyro_rad_s.norm() < 3 * (o.imu.gyro_bias_sigma_rad_s + gyro_limit / std::sqrt(count));
  r.gyro_sigma_rad_s = o.imu.gyro_noise_rad_s_sqrt_hz / std::sqrt(seconds) + 1e-7;
  // A moving rover accelerates: the error of its mean is of the order of the scatter.
  r.accel_sigma_m_s2 = o.imu.accel_noise_m_s2_sqrt_hz / std::sqrt(seconds) + (r.stationary ? 0 : accel_scatter);
  return r;
}

std::optional<Heading> consensus_heading(std::span<const CompassSample> readings, double min_sigma) {
  std::size_t best = 0, most = 0;
  const auto sigma = [&](const CompassSample& s) { return std::max(s.sigma_rad, min_sigma); };
  const auto agree = [&](const CompassSample& a, const CompassSample& b) {
    return std::abs(wrapped(a.heading_rad - b.heading_rad)) <= 3 * std::hypot(sigma(a), sigma(b));
  };
  for (std::size_t i = 0; i < readings.size(); ++i) {
    const auto n = static_cast<std::size_t>(
        std::count_if(readings.begin(), readings.end(), [&](const auto& other) { return agree(readings[i], other); }));
    if (n > most) {
      most = n;
      best = i;
    }
  }
  if (most == 0 || (readings.size() > 1 && 2 * most <= readings.size())) return std::nullopt;
  double sum = 0, weights = 0;
  for (const CompassSample& s : readings) {
    if (!agree(readings[best], s)) continue;
    const double weight = 1 / (sigma(s) * sigma(s));
    sum += weight * wrapped(s.heading_rad - readings[best].heading_rad);
    weights += weight;
  }
  return Heading{wrapped(readings[best].heading_rad + sum / weights), 1 / std::sqrt(weights)};
}

std::optional<Tilt> median_tilt(std::span<const InclinometerSample> readings, double min_sigma) {
  if (readings.empty()) return std::nullopt;
  std::vector<double> rolls, pitches;
  double variance = 0;
  for (const InclinometerSample& s : readings) {
    rolls.push_back(s.roll_rad);
    pitches.push_back(s.pitch_rad);
    variance = std::max({variance, s.sigma_rad * s.sigma_rad, min_sigma * min_sigma});
  }
  const auto middle = static_cast<std::ptrdiff_t>(readings.size() / 2);
  std::nth_element(rolls.begin(), rolls.begin() + middle, rolls.end());
  std::nth_element(pitches.begin(), pitches.begin() + middle, pitches.end());
  // Variance of the median of n normal readings: π/2 σ²/n.
  const double sigma =
      std::sqrt(variance * (readings.size() > 1 ? 0.5 * std::numbers::pi : 1.0) / static_cast<double>(readings.size()));
  return Tilt{rolls[static_cast<std::size_t>(middle)], pitches[static_cast<std::size_t>(middle)], sigma};
}

Pose first_pose(const Eigen::Vector3d& up_in_body, const Eigen::Vector3d& ahead_in_body, double ahead_heading) {
  const Eigen::Vector3d up = up_in_body.normalized();
  const auto horizontal = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d { return v - v.dot(up) * up; };
  Eigen::Vector3d ahead = horizontal(ahead_in_body.normalized());
  if (ahead.norm() < 1e-3) ahead = horizontal(Eigen::Vector3d::UnitX());
  if (ahead.norm() < 1e-3) ahead = horizontal(Eigen::Vector3d::UnitY());
  ahead.normalize();
  Eigen::Matrix3d level_from_body;  // rows: axes in the body frame
  level_from_body.row(0) = ahead;
  level_from_body.row(1) = up.cross(ahead);
  level_from_body.row(2) = up;
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(ahead_heading, Eigen::Vector3d::UnitZ()));
  return {turn * Eigen::Quaterniond(level_from_body), Eigen::Vector3d::Zero()};
}

}  // namespace spartan
