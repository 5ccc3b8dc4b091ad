#include "spartan/numerics/umeyama.h"

#include <Eigen/Dense>
#include <stdexcept>

namespace spartan {
namespace {

/// Ratio of the second to the first singular value below which points count as collinear; far above rounding.
constexpr double kCollinear = 1e-9;

}  // namespace

std::optional<UmeyamaFit> fit_umeyama(std::span<const Eigen::Vector3d> target, std::span<const Eigen::Vector3d> source,
                                      FitScale scale, std::span<const double> weights) {
  if (target.size() != source.size() || (!weights.empty() && weights.size() != source.size())) {
    throw std::invalid_argument("fit_umeyama: as many source points as target points (and weights) are needed");
  }
  const auto weight = [&](std::size_t i) { return weights.empty() ? 1.0 : weights[i]; };
  double total = 0;
  Eigen::Vector3d target_mean = Eigen::Vector3d::Zero(), source_mean = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < source.size(); ++i) {
    total += weight(i);
    target_mean += weight(i) * target[i];
    source_mean += weight(i) * source[i];
  }
  if (!(total > 0)) return std::nullopt;
  target_mean /= total;  // eq. 35
  source_mean /= total;  // eq. 34

  double source_variance = 0;                            // eq. 36
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // eq. 38
  for (std::size_t i = 0; i < source.size(); ++i) {
    source_variance += weight(i) / total * (source[i] - source_mean).squaredNorm();
    covariance += weight(i) / total * (target[i] - target_mean) * (source[i] - source_mean).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();  // diagonal of S, eq. 39 and 43
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) signs[2] = -1;
  const Eigen::Matrix3d rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();  // eq. 40

  UmeyamaFit fit;
  const Eigen::Vector3d& singular = svd.singularValues();
  fit.unique = singular[0] > 0 && singular[1] > kCollinear * singular[0];
  double s = 1;
  if (scale == FitScale::estimated && source_variance > 0) s = singular.dot(signs) / source_variance;  // eq. 42
  fit.target_from_source = {s, Pose(rotation, target_mean - s * rotation * source_mean)};              // eq. 41
  return fit;
}

}  // namespace spartan
