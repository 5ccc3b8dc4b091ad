#include "spartan/eval/alignment.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

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
    throw std::invalid_argument("alignment: as many source points as target points are needed, at least one");
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
  for (const auto& [value, known] : kNames) {
    if (known == name) return value;
  }
  return std::nullopt;
}

Similarity fit_similarity(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target,
                          bool with_scale) {
  check_counts(source, target);
  const Eigen::Vector3d source_mean = mean(source), target_mean = mean(target);  // eq. 34, 35
  const double share = 1.0 / static_cast<double>(source.size());
  double source_variance = 0;                            // eq. 36
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // eq. 38
  for (std::size_t i = 0; i < source.size(); ++i) {
    source_variance += share * (source[i] - source_mean).squaredNorm();
    covariance += share * (target[i] - target_mean) * (source[i] - source_mean).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();  // the diagonal of S, eq. 39 and 43
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) signs.z() = -1;
  const Eigen::Matrix3d rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();  // eq. 40
  const bool scale_is_known = with_scale && source_variance > 0;
  const double scale = scale_is_known ? svd.singularValues().dot(signs) / source_variance : 1.0;  // eq. 42
  return {scale, Pose(rotation, target_mean - scale * rotation * source_mean)};                   // eq. 41
}

Similarity fit_yaw(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target) {
  check_counts(source, target);
  // Σ targetᵀ Rz(θ) source = C cos θ + S sin θ + const. is largest at θ = atan2(S, C); points about their means.
  const Eigen::Vector3d source_mean = mean(source), target_mean = mean(target);
  double along = 0, across = 0;
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Eigen::Vector3d s = source[i] - source_mean, t = target[i] - target_mean;
    along += s.x() * t.x() + s.y() * t.y();
    across += s.x() * t.y() - s.y() * t.x();
  }
  const Eigen::Quaterniond rotation(Eigen::AngleAxisd(std::atan2(across, along), Eigen::Vector3d::UnitZ()));
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
