// The radial-tangential camera model (Brown–Conrady, "plumb bob", rational) with OpenCV's coefficients.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "spartan/rig/models/pinhole.h"

namespace spartan {

/// With x = X/Z, y = Y/Z, r² = x² + y²:
///   c = (1 + k1 r² + k2 r⁴ + k3 r⁶) / (1 + k4 r² + k5 r⁴ + k6 r⁶)
///   x' = x c + 2 p1 x y + p2 (r² + 2x²),  y' = y c + p1 (r² + 2y²) + 2 p2 x y
///   u = fx x' + cx, v = fy y' + cy
/// Source: OpenCV documentation, "Camera Calibration and 3D Reconstruction"; Brown 1966.
/// Domain: z > 0, r below the radius where the radial map r → r c stops increasing (d(r c)/dr = 0) or has a pole, and
/// positive Jacobian determinant of (x, y) → (x', y'), which only strong tangential terms near the edge violate.
/// Outside of the domain the distortion is not invertible (the image folds back) and project() returns nullopt.
class RadialTangentialModel {
 public:
  /// In OpenCV's order: k1 k2 p1 p2 k3 k4 k5 k6.
  using Coefficients = std::array<double, 8>;

  RadialTangentialModel() : RadialTangentialModel({}, {}) {}
  RadialTangentialModel(PinholeModel pinhole, Coefficients coefficients);

  static constexpr std::string_view kName = "radial_tangential";
  static std::vector<ModelParameterSpec> parameter_specs();
  ModelParameters parameters() const;
  static RadialTangentialModel from_parameters(const ModelParameters& parameters);

  const PinholeModel& pinhole() const { return pinhole_; }
  const Coefficients& coefficients() const { return coefficients_; }
  /// Upper bound of r in the normalized image plane; infinity if the radial map increases everywhere.
  double largest_radius() const { return largest_radius_; }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point) const;
  std::optional<ProjectionWithJacobian> project_with_jacobian(const Eigen::Vector3d& point) const;
  /// By damped Newton iterations to 1e-12 in the normalized image plane; nullopt outside of the domain.
  std::optional<Ray> unproject(const Eigen::Vector2d& pixel) const;
  friend bool operator==(const RadialTangentialModel& a, const RadialTangentialModel& b) {
    return a.pinhole_ == b.pinhole_ && a.coefficients_ == b.coefficients_;
  }

 private:
  PinholeModel pinhole_;
  Coefficients coefficients_{};
  double largest_radius_ = 0;
};

}  // namespace spartan
