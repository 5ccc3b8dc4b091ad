// The double-sphere camera model for wide-angle and fisheye lenses.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "spartan/rig/models/pinhole.h"

namespace spartan {

/// With d1 = |p|, h = ξ d1 + Z, d2 = √(X² + Y² + h²):
///   u = fx X/(α d2 + (1 − α) h) + cx, v = fy Y/(α d2 + (1 − α) h) + cy
/// Source: Usenko, Demmel, Cremers, "The double sphere camera model", 3DV 2018, eq. 40–52. ξ = 0 gives the
/// unified camera model with α, α = 0 that of Mei with ξ, and ξ = α = 0 the pinhole.
/// Domain: h > −w d2 with w = α/(1 − α) for α ≤ ½ and (1 − α)/α above, and d1 + ξ Z > 0 (restrictive only for |ξ| > 1).
/// There the image radius increases with the off-axis angle (docs/math/camera_models.md). The bound on Z in eq. 43–45
/// of the paper is equal for ξ = 0 and for α = ½, and more restrictive otherwise.
struct DoubleSphereModel {
  PinholeModel pinhole;
  double xi = 0;
  double alpha = 0;  ///< in [0, 1]

  static constexpr std::string_view kName = "double_sphere";
  static std::vector<ModelParameterSpec> parameter_specs();
  ModelParameters parameters() const;
  static DoubleSphereModel from_parameters(const ModelParameters& parameters);

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point) const;
  std::optional<ProjectionWithJacobian> project_with_jacobian(const Eigen::Vector3d& point) const;
  std::optional<Ray> unproject(const Eigen::Vector2d& pixel) const;
  friend bool operator==(const DoubleSphereModel&, const DoubleSphereModel&) = default;
};

}  // namespace spartan
