// The equidistant fisheye camera model (Kannala–Brandt with four coefficients; OpenCV "fisheye", Kalibr "equidistant").
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "spartan/rig/models/pinhole.h"

namespace spartan {

/// With θ the angle between the point and the optical axis and φ the azimuth about it:
///   θ = atan2(√(X² + Y²), Z),  ρ = θ (1 + k1 θ² + k2 θ⁴ + k3 θ⁶ + k4 θ⁸)
///   u = fx ρ cos φ + cx, v = fy ρ sin φ + cy
/// Source: Kannala and Brandt, "A generic camera model and calibration method for conventional, wide-angle, and
/// fish-eye lenses", PAMI 2006, eq. 6 with the coefficients divided by the first; OpenCV documentation, "Fisheye camera
/// model". Domain: θ below π and below the angle where ρ stops increasing (dρ/dθ = 0); points with z ≤ 0 project too.
class EquidistantModel {
 public:
  using Coefficients = std::array<double, 4>;

  EquidistantModel() : EquidistantModel({}, {}) {}
  EquidistantModel(PinholeModel pinhole, Coefficients coefficients);

  static constexpr std::string_view kName = "equidistant";
  static std::vector<ModelParameterSpec> parameter_specs();
  ModelParameters parameters() const;
  static EquidistantModel from_parameters(const ModelParameters& parameters);

  const PinholeModel& pinhole() const { return pinhole_; }
  const Coefficients& coefficients() const { return coefficients_; }
  /// Upper bound of θ, rad.
  double largest_angle() const { return largest_angle_; }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point) const;
  std::optional<ProjectionWithJacobian> project_with_jacobian(const Eigen::Vector3d& point) const;
  std::optional<Ray> unproject(const Eigen::Vector2d& pixel) const;
  friend bool operator==(const EquidistantModel& a, const EquidistantModel& b) {
    return a.pinhole_ == b.pinhole_ && a.coefficients_ == b.coefficients_;
  }

 private:
  PinholeModel pinhole_;
  Coefficients coefficients_{};
  double largest_angle_ = 0;
};

}  // namespace spartan
