#include "spartan/reconstruction/internal/calibration_variance.h"

#include <Eigen/Geometry>
#include <cmath>

#include "spartan/core/pose.h"

namespace spartan::internal {
namespace {

double squared(double value) {
  return value * value;
}

}  // namespace

double calibration_variance_m2(const CellSight& cell, const CalibrationErrors& errors) {
  const Eigen::Vector3d& arm = cell.from_camera_m;
  const Eigen::Vector3d normal(-cell.slope.x(), -cell.slope.y(), 1);
  const double rotation =
      squared(kRadiansPerDegree) * (squared(errors.mount_rotation_deg) + squared(errors.pan_tilt_deg));
  const double yaw =
      cell.baseline_m > 0 ? errors.pair_rotation_deg * kRadiansPerDegree * arm.norm() / cell.baseline_m : 0;
  return rotation * arm.cross(normal).squaredNorm() + squared(1e-3 * errors.mount_mm) * normal.squaredNorm() +
         (squared(yaw) + squared(0.01 * errors.scale_percent)) * squared(arm.dot(normal));
}

}  // namespace spartan::internal
