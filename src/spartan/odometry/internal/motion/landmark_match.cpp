#include "spartan/odometry/internal/motion/landmark_match.h"

namespace spartan::internal {
namespace {

/// Variance of what was not measured, pixels²: large against every residual.
constexpr double kUnmeasured_px2 = 1e4;

}  // namespace

void LandmarkMatch::set_measured(const Eigen::Vector2d& left_px, const Eigen::Matrix2d& covariance_px2,
                                 double disparity_px, double disparity_sigma_px) {
  cameras = MeasuredIn::both;
  measured << left_px, disparity_px;
  covariance.setZero();
  covariance.topLeftCorner<2, 2>() = covariance_px2;
  covariance(2, 2) = disparity_sigma_px * disparity_sigma_px;
}

void LandmarkMatch::set_measured_in_one(MeasuredIn camera, const Eigen::Vector2d& position_px,
                                        const Eigen::Matrix2d& covariance_px2, double predicted_disparity_px) {
  set_measured(position_px, covariance_px2, predicted_disparity_px, 0);
  cameras = camera;
  covariance(2, 2) = kUnmeasured_px2;
  if (camera != MeasuredIn::right) return;
  // u = u_right + d.
  measured.x() += predicted_disparity_px;
  covariance(0, 0) += kUnmeasured_px2;
  covariance(0, 2) = covariance(2, 0) = kUnmeasured_px2;
}

Eigen::Vector3d LandmarkMatch::observed(const Eigen::Vector3d& difference) const {
  if (cameras == MeasuredIn::both) return difference;
  const double shift = cameras == MeasuredIn::right ? difference.z() : 0;  // u_right = u − d
  return {difference.x() - shift, difference.y(), 0};
}

}  // namespace spartan::internal
