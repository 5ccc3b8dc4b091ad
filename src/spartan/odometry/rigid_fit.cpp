#include "spartan/odometry/rigid_fit.h"

#include <Eigen/SVD>

namespace spartan {

std::optional<Pose> fit_rigid(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b,
                              const std::vector<double>& weights) {
  if (a.size() < 3) return std::nullopt;
  double total = 0;
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero(), mean_b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) {
    total += weights[i];
    mean_a += weights[i] * a[i];
    mean_b += weights[i] * b[i];
  }
  if (!(total > 0)) return std::nullopt;
  mean_a /= total;
  mean_b /= total;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < a.size(); ++i) {
    covariance += weights[i] / total * (a[i] - mean_a) * (b[i] - mean_b).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // On a line only one singular value is left, and the turn about it is free.
  if (!(svd.singularValues()[1] > 1e-9 * svd.singularValues()[0]) || !(svd.singularValues()[0] > 0)) {
    return std::nullopt;
  }
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0) sign[2] = -1;
  const Eigen::Matrix3d rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  return Pose(rotation, mean_a - rotation * mean_b);
}

}  // namespace spartan
