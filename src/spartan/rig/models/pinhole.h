// The pinhole camera model.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "spartan/rig/models/model_parameters.h"
#include "spartan/rig/models/ray.h"

namespace spartan {

/// u = fx x/z + cx, v = fy y/z + cy. Domain: z > 0. Integer coordinates are pixel centres.
struct PinholeModel {
  double fx = 1, fy = 1;  ///< px
  double cx = 0, cy = 0;  ///< px

  static constexpr std::string_view kName = "pinhole";
  static std::vector<ModelParameterSpec> parameter_specs();
  ModelParameters parameters() const;
  static PinholeModel from_parameters(const ModelParameters& parameters);

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point) const;
  std::optional<ProjectionWithJacobian> project_with_jacobian(const Eigen::Vector3d& point) const;
  std::optional<Ray> unproject(const Eigen::Vector2d& pixel) const;
  friend bool operator==(const PinholeModel&, const PinholeModel&) = default;
};

}  // namespace spartan
