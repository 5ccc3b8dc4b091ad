// CAHV: the linear photogrammetric camera model of JPL.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "spartan/rig/models/pinhole.h"

namespace spartan {

/// With the vectors C (projection centre), A (unit image-plane normal), H (horizontal) and V (vertical):
///   u = (P − C)·H / (P − C)·A,  v = (P − C)·V / (P − C)·A
/// Source: Yakimovsky and Cunningham, "A system for extracting three-dimensional measurements from a stereo pair of TV
/// cameras", CGIP 1978. The camera frame here has its origin in C, z along A, x along the component of H perpendicular
/// to A, and y = z × x:
///   A = (0, 0, 1),  H = (fx, 0, cx),  V = (skew, fy, cy)
/// which is the pinhole `core` with a skew (rows and columns of a real sensor are perpendicular; fitted vectors need
/// not be). Domain: z > 0.
struct CahvModel {
  PinholeModel core;
  double skew_px = 0;  ///< the x component of V

  static constexpr std::string_view kName = "cahv";
  static std::vector<ModelParameterSpec> parameter_specs();
  ModelParameters parameters() const;
  static CahvModel from_parameters(const ModelParameters& parameters);

  Eigen::Vector3d h() const { return {core.fx, 0, core.cx}; }
  Eigen::Vector3d v() const { return {skew_px, core.fy, core.cy}; }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point) const;
  std::optional<ProjectionWithJacobian> project_with_jacobian(const Eigen::Vector3d& point) const;
  std::optional<Ray> unproject(const Eigen::Vector2d& pixel) const;
  friend bool operator==(const CahvModel&, const CahvModel&) = default;
};

}  // namespace spartan
