#include "spartan/sim/internal/drive/body_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace spartan::sim::internal {
namespace {

// Points in a disc of radius 1 whose mean approximates the mean over the disc.
constexpr std::size_t kDiscPoints = 9;
constexpr std::array<double, kDiscPoints> kDiscX{0, 0.7, -0.7, 0, 0, 0.5, -0.5, 0.5, -0.5};
constexpr std::array<double, kDiscPoints> kDiscY{0, 0, 0, 0.7, -0.7, 0.5, 0.5, -0.5, -0.5};

}  // namespace

Vector6d fit_to_ground(const WheelGround& ground, const ChassisOptions& chassis, const PlanarPose& at) {
  const double c = std::cos(at.heading), s = std::sin(at.heading);
  std::array<double, 4 * kDiscPoints> x{}, y{}, z{};
  std::array<double, 4> height{};
  std::size_t n = 0;
  for (int wheel = 0; wheel < 4; ++wheel) {
    const double along = (wheel < 2 ? 0.5 : -0.5) * chassis.wheelbase_m,
                 aside = (wheel % 2 == 0 ? 0.5 : -0.5) * chassis.track_m;
    height[static_cast<std::size_t>(wheel)] =
        ground.rocks.at(at.x + c * along - s * aside, at.y + s * along + c * aside, at.heading);
    for (std::size_t k = 0; k < kDiscPoints; ++k, ++n) {
      const double a = along + chassis.wheel_radius_m * kDiscX[k], b = aside + chassis.wheel_radius_m * kDiscY[k];
      x[n] = at.x + c * a - s * b;
      y[n] = at.y + s * a + c * b;
    }
  }
  ground.shape.heights(x, y, z);
  for (std::size_t i = 0; i < z.size(); ++i) height[i / kDiscPoints] += z[i] / kDiscPoints;
  // Least-squares plane over a rectangle: each slope is the difference of the means of two sides.
  const double rise_along = ((height[0] + height[1]) - (height[2] + height[3])) / (2 * chassis.wheelbase_m);
  const double rise_aside = ((height[0] + height[2]) - (height[1] + height[3])) / (2 * chassis.track_m);
  const double pitch = -std::atan(rise_along);
  const double roll = std::atan(rise_aside * std::cos(pitch));
  Vector6d result;
  result << at.x, at.y, (height[0] + height[1] + height[2] + height[3]) / 4, roll, pitch, at.heading;
  return result;
}

BodyMotion::BodyMotion(const Drive& drive, const WheelGround& ground, const ChassisOptions& chassis,
                       const ThreadPool& workers)
    : knots_(static_cast<std::size_t>(std::ceil(drive.seconds() / kKnot_s)) + 1) {
  workers.parallel_for(0, static_cast<int>(knots_.size()), 256, [&](int from, int to) {
    for (int i = from; i < to; ++i)
      knots_[static_cast<std::size_t>(i)] = fit_to_ground(ground, chassis, drive.at(i * kKnot_s));
  });
}

// Uniform cubic B-spline of the four knots around the time, or its derivative.
Vector6d BodyMotion::evaluate_spline(double time_s, int derivative) const {
  const double knot = std::clamp(time_s / kKnot_s, 0.0, static_cast<double>(knots_.size() - 1) - 1e-9);
  const auto i = static_cast<std::ptrdiff_t>(knot);
  const double t = knot - static_cast<double>(i), u = 1 - t;
  std::array<double, 4> w{};
  if (derivative == 0) {
    w = {u * u * u / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * u * u * u - 6 * u * u + 4) / 6, t * t * t / 6};
  } else if (derivative == 1) {
    w = {-u * u / 2, (3 * t * t - 4 * t) / 2, (4 * u - 3 * u * u) / 2, t * t / 2};
  } else {
    w = {u, 3 * t - 2, 3 * u - 2, t};
  }
  Vector6d sum = Vector6d::Zero();
  for (std::ptrdiff_t k = 0; k < 4; ++k) {
    const auto at = std::clamp<std::ptrdiff_t>(i + k - 1, 0, static_cast<std::ptrdiff_t>(knots_.size()) - 1);
    sum += w[static_cast<std::size_t>(k)] * knots_[static_cast<std::size_t>(at)];
  }
  return sum / std::pow(kKnot_s, derivative);
}

Pose BodyMotion::world_from_body(double time_s) const {
  const Vector6d p = evaluate_spline(time_s, 0);
  const Eigen::Quaterniond rotation = Eigen::AngleAxisd(p[5], Eigen::Vector3d::UnitZ()) *
                                      Eigen::AngleAxisd(p[4], Eigen::Vector3d::UnitY()) *
                                      Eigen::AngleAxisd(p[3], Eigen::Vector3d::UnitX());
  return {rotation, p.head<3>()};
}

Eigen::Vector3d BodyMotion::velocity(double time_s) const {
  return evaluate_spline(time_s, 1).head<3>();
}
Eigen::Vector3d BodyMotion::acceleration(double time_s) const {
  return evaluate_spline(time_s, 2).head<3>();
}
Eigen::Vector3d BodyMotion::roll_pitch_yaw(double time_s) const {
  return evaluate_spline(time_s, 0).tail<3>();
}

// Body rates from the rates of z-y-x Euler angles: ω = (ṙ − ẏ sin p, ṗ cos r + ẏ sin r cos p, ẏ cos r cos p − ṗ sin r).
Eigen::Vector3d BodyMotion::angular_velocity(double time_s) const {
  const Vector6d at = evaluate_spline(time_s, 0), rate = evaluate_spline(time_s, 1);
  const double r = at[3], p = at[4];
  return {rate[3] - rate[5] * std::sin(p), rate[4] * std::cos(r) + rate[5] * std::sin(r) * std::cos(p),
          rate[5] * std::cos(r) * std::cos(p) - rate[4] * std::sin(r)};
}

}  // namespace spartan::sim::internal
