// Variance of a map cell's elevation by errors of the calibration.
#pragma once

#include <Eigen/Core>

#include "spartan/reconstruction/map_generator.h"

namespace spartan::internal {

/// How a cell of the ground was seen.
struct CellSight {
  Eigen::Vector3d from_camera_m = Eigen::Vector3d::Zero();  ///< from the camera to the cell, map axes
  double baseline_m = 0;                                    ///< of the pair; 0: unknown
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();          ///< ∂z/∂x, ∂z/∂y of the ground
};

/// A rotation ω of the cameras (mount, pan and tilt), a shift t of them and a relative error ε of the range move the
/// point at the arm a from the camera by δ = ω × a + t + ε a. The surface through it, with the normal n = (−∂z/∂x,
/// −∂z/∂y, 1), rises by n · δ, so that the variance of its elevation is
///   σω² |a × n|² + σt² |n|² + σε² (a · n)²,  σε² = (σψ |a| / b)² + σs²,
/// where σψ is the yaw between the cameras, which is an error f σψ of all disparities, b the baseline and σs the scale.
double calibration_variance_m2(const CellSight& cell, const CalibrationErrors& errors);

}  // namespace spartan::internal
