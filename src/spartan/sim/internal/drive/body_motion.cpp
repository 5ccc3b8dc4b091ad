#include "spartan/sim/internal/drive/body_motion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

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

namespace {

// Uphill slope (rise over run) of the plane under a body in the directions of its heading and to the left of it.
Eigen::Vector2d slopes_under(const Vector6d& body) {
  return {-std::tan(body[4]), std::tan(body[3]) / std::cos(body[4])};
}

struct Creep {
  std::vector<Eigen::Vector2d> offsets;   // from the path
  std::vector<Eigen::Vector2d> distance;  // crept since the start
};

// At rest the rover creeps downhill, driving it steers back to its path within kReturn_m.
Creep creep(const std::vector<PlanarPose>& path, const std::vector<Vector6d>& bodies, double creep_m_s) {
  constexpr double kReturn_m = 2, kAtRest_m_s = 1e-3;
  Creep result{std::vector<Eigen::Vector2d>(path.size(), Eigen::Vector2d::Zero()), {}};
  result.distance = result.offsets;
  for (std::size_t i = 1; i < path.size(); ++i) {
    const PlanarPose &before = path[i - 1], &here = path[i];
    const double step_m = std::hypot(here.x - before.x, here.y - before.y);
    result.offsets[i] = result.offsets[i - 1] * std::exp(-step_m / kReturn_m);
    result.distance[i] = result.distance[i - 1];
    if (step_m > kAtRest_m_s * BodyMotion::kKnot_s) continue;
    const Eigen::Vector2d uphill = Eigen::Rotation2Dd(here.heading) * slopes_under(bodies[i]);
    const Eigen::Vector2d step = -creep_m_s * BodyMotion::kKnot_s * uphill;
    result.offsets[i] += step;
    result.distance[i] += step;
  }
  return result;
}

}  // namespace

BodyMotion::BodyMotion(const Drive& drive, const WheelGround& ground, const ChassisOptions& chassis,
                       const ThreadPool& workers, const WheelOptions& wheels)
    : knots_(static_cast<std::size_t>(std::ceil(drive.seconds() / kKnot_s)) + 1) {
  std::vector<PlanarPose> path(knots_.size());
  for (std::size_t i = 0; i < path.size(); ++i) path[i] = drive.at(static_cast<double>(i) * kKnot_s);
  const auto fit_all = [&] {
    workers.parallel_for(0, static_cast<int>(knots_.size()), 256, [&](int from, int to) {
      for (auto i = static_cast<std::size_t>(from); i < static_cast<std::size_t>(to); ++i)
        knots_[i] = fit_to_ground(ground, chassis, path[i]);
    });
  };
  fit_all();
  if (wheels.creep_m_s == 0 && wheels.side_slip == 0) return;
  Creep crept = creep(path, knots_, wheels.creep_m_s);
  for (std::size_t i = 0; i < path.size(); ++i) {
    path[i].x += crept.offsets[i].x();
    path[i].y += crept.offsets[i].y();
    // Heading uphill of the path by the angle at which it slips downhill keeps the rover on the path.
    path[i].heading += std::atan(wheels.side_slip * slopes_under(knots_[i]).y());
  }
  fit_all();
  creep_ = std::move(crept.distance);
}

namespace {

// Uniform cubic B-spline of the four knots around the time, or its derivative.
template <class Vector>
Vector spline(const std::vector<Vector>& knots, double time_s, int derivative) {
  constexpr double kKnot_s = BodyMotion::kKnot_s;
  const double knot = std::clamp(time_s / kKnot_s, 0.0, static_cast<double>(knots.size() - 1) - 1e-9);
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
  Vector sum = Vector::Zero();
  for (std::ptrdiff_t k = 0; k < 4; ++k) {
    const auto at = std::clamp<std::ptrdiff_t>(i + k - 1, 0, static_cast<std::ptrdiff_t>(knots.size()) - 1);
    sum += w[static_cast<std::size_t>(k)] * knots[static_cast<std::size_t>(at)];
  }
  return sum / std::pow(kKnot_s, derivative);
}

}  // namespace

Vector6d BodyMotion::evaluate_spline(double time_s, int derivative) const {
  return spline(knots_, time_s, derivative);
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
Eigen::Vector3d BodyMotion::creep_velocity(double time_s) const {
  if (creep_.empty()) return Eigen::Vector3d::Zero();
  const Eigen::Vector2d level = spline(creep_, time_s, 1);
  const Eigen::Vector3d up = world_from_body(time_s).rotation() * Eigen::Vector3d::UnitZ();
  return {level.x(), level.y(), -up.head<2>().dot(level) / up.z()};
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
