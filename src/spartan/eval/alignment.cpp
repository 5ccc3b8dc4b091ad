#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "spartan/eval/trajectory_metrics.h"
#include "spartan/numerics/umeyama.h"

namespace spartan {
namespace {

constexpr std::array<std::pair<Alignment, std::string_view>, 5> kNames{{{Alignment::none, "none"},
                                                                        {Alignment::first, "first"},
                                                                        {Alignment::yaw, "yaw"},
                                                                        {Alignment::se3, "se3"},
                                                                        {Alignment::sim3, "sim3"}}};

Eigen::Vector3d mean(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

void check_counts(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target) {
  if (source.empty() || source.size() != target.size()) {
    throw std::invalid_argument("alignment: source and target must have the same number of points, at least one");
  }
}

std::vector<Eigen::Vector3d> positions(const Trajectory& trajectory) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(trajectory.size());
  for (const StampedPose& entry : trajectory) points.push_back(entry.pose.translation());
  return points;
}

}  // namespace

std::string_view name_of(Alignment alignment) {
  for (const auto& [value, name] : kNames) {
    if (value == alignment) return name;
  }
  return "unknown";
}

std::optional<Alignment> alignment_named(std::string_view name) {
  for (const auto& [value, known_name] : kNames) {
    if (known_name == name) return value;
  }
  return std::nullopt;
}

Similarity fit_similarity(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target,
                          bool with_scale) {
  check_counts(source, target);
  return fit_umeyama(target, source, with_scale ? FitScale::estimated : FitScale::fixed)->target_from_source;
}

Similarity fit_yaw(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target) {
  check_counts(source, target);
  // For points relative to their means, Σ targetᵀ Rz(θ) source = C cos θ + S sin θ + const., with maximum at
  // θ = atan2(S, C).
  const Eigen::Vector3d source_mean = mean(source), target_mean = mean(target);
  double cosine_sum = 0, sine_sum = 0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Eigen::Vector3d s = source[i] - source_mean, t = target[i] - target_mean;
    cosine_sum += s.x() * t.x() + s.y() * t.y();
    sine_sum += s.x() * t.y() - s.y() * t.x();
  }
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(std::atan2(sine_sum, cosine_sum), Eigen::Vector3d::UnitZ()));
  return {1.0, Pose(rotation, target_mean - rotation * source_mean)};
}

Similarity align(const Trajectory& estimate, const Trajectory& truth, Alignment alignment) {
  switch (alignment) {
    case Alignment::none:
      return {};
    case Alignment::first:
      return {1.0, truth.front().pose * estimate.front().pose.inverse()};
    case Alignment::yaw:
      return fit_yaw(positions(estimate), positions(truth));
    case Alignment::se3:
      return fit_similarity(positions(estimate), positions(truth), false);
    case Alignment::sim3:
      return fit_similarity(positions(estimate), positions(truth), true);
  }
  return {};
}

}  // namespace spartan
