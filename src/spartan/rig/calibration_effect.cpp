#include <cmath>

#include "spartan/rig/rig.h"

namespace spartan {

CalibrationEffect calibration_effect(const Pose& body_motion, const Pose& body_from_left, const Rig& rig,
                                     const StereoPair& pair, const CalibrationErrors& errors) {
  const Matrix6d to_body = adjoint(body_from_left);
  CalibrationEffect effect = CalibrationEffect::Zero();

  if (rig.convention == PoseConvention::body) {
    const bool fixed = rig.find_camera(pair.left)->mount == "body";
    const double rotation_rad =
        kRadiansPerDegree * std::hypot(errors.mount_rotation_deg, fixed ? 0 : errors.pan_tilt_deg);
    // About axes through the camera, along those of the camera.
    Vector6d mount;
    mount.head<3>().setConstant(1e-3 * errors.mount_mm);
    mount.tail<3>().setConstant(rotation_rad);
    effect.leftCols<6>() = (Matrix6d::Identity() - adjoint(body_motion.inverse())) * to_body * mount.asDiagonal();
  }

  const Pose motion = body_from_left.inverse() * body_motion * body_from_left;
  Vector6d moved, turned;
  moved << motion.rotation().conjugate() * motion.translation(), Eigen::Vector3d::Zero();
  turned << Eigen::Vector3d::Zero(), log_so3(motion.rotation());
  const double scale = 0.01 * errors.scale_percent;
  effect.col(6) = scale * (to_body * moved);
  effect.col(7) = scale * (to_body * turned);
  return effect;
}

}  // namespace spartan
