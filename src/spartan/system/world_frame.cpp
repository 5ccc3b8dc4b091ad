#include "spartan/system/world_frame.h"

#include <cmath>

namespace spartan {
namespace {

constexpr std::size_t kFewestSamples = 10;
constexpr double kLargestLevelError = 0.05;  // of gravity
constexpr double kLargestScatter = 0.10;     // of gravity

}  // namespace

std::optional<Eigen::Vector3d> measure_up(std::span<const ImuSample> samples, double gravity_m_s2) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double squares = 0;
  std::size_t count = 0;
  for (const ImuSample& sample : samples) {
    if (!sample.accel_m_s2.allFinite()) continue;
    sum += sample.accel_m_s2;
    squares += sample.accel_m_s2.squaredNorm();
    ++count;
  }
  if (count < kFewestSamples) return std::nullopt;
  const Eigen::Vector3d mean = sum / static_cast<double>(count);
  const double scatter = std::sqrt(std::max(0.0, squares / static_cast<double>(count) - mean.squaredNorm()));
  if (std::abs(mean.norm() - gravity_m_s2) > kLargestLevelError * gravity_m_s2) return std::nullopt;
  if (scatter > kLargestScatter * gravity_m_s2) return std::nullopt;
  return mean.normalized();
}

Pose first_world_from_body(const Pose& body_from_left, const std::optional<Eigen::Vector3d>& up_in_body) {
  const Eigen::Vector3d up = up_in_body.value_or(Eigen::Vector3d::UnitZ());
  const auto horizontal = [&](const Eigen::Vector3d& v) -> Eigen::Vector3d { return v - v.dot(up) * up; };
  Eigen::Vector3d ahead = horizontal(body_from_left.rotation() * Eigen::Vector3d::UnitZ());
  if (ahead.norm() < 1e-3) ahead = horizontal(Eigen::Vector3d::UnitX());
  if (ahead.norm() < 1e-3) ahead = horizontal(Eigen::Vector3d::UnitY());
  ahead.normalize();
  Eigen::Matrix3d world_from_body;  // rows: the world's axes seen from the body
  world_from_body.row(0) = ahead;
  world_from_body.row(1) = up.cross(ahead);
  world_from_body.row(2) = up;
  return {world_from_body, Eigen::Vector3d::Zero()};
}

}  // namespace spartan
