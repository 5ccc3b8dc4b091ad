// CAHVORE: CAHVOR for fisheye lenses with a moving entrance pupil, a non-central camera model.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "spartan/rig/models/cahvor.h"

namespace spartan {

/// With P relative to C, ω = P·O, λ = P − ω O: the ray through P starts on the axis O, at the distance
///   s(θ) = (θ/sin θ − 1)(e0 + e1 θ² + e2 θ⁴)
/// from C (the entrance pupil), with the off-axis angle θ that solves (ω − s) sin θ = |λ| cos θ. With the linearity L
///   χ = tan(L θ)/L for L > 0, θ for L = 0, sin(L θ)/L for L < 0
///   μ = r0 + r1 χ² + r2 χ⁴,  P' = (|λ|/χ) O + (1 + μ) λ,  (u, v) = CAHV of P'
/// L = 1 with e = 0 is CAHVOR; L = 0 is equidistant.
/// Source: Gennery, "Generalized camera calibration including fish-eye lenses", IJCV 2006; JPL's file types 1, 2 and 3
/// are L = 1, L = 0 and a given L. Frame as in cahv.h.
/// Domain: θ below π, below π/(2|L|), below the angle where χ (1 + μ) stops increasing, and below the angle where the
/// pupil diverges (five times as far from C as within 90°); P farther from C than any intersection of neighbouring rays
/// (nearest_m()), so that θ is unique (docs/math/camera_models.md); P' in front of the camera (z > 0).
class CahvoreModel {
 public:
  using Radial = CahvorModel::Radial;
  using Entrance = std::array<double, 3>;

  CahvoreModel() : CahvoreModel({}, Eigen::Vector3d::UnitZ(), {}, {}, 1) {}
  /// `optical_axis`: the unit vector O in the camera frame. `radial`: r0, r1, r2. `entrance_m`: e0, e1, e2.
  /// `linearity`: L in [-1, 1].
  CahvoreModel(CahvModel cahv, const Eigen::Vector3d& optical_axis, Radial radial, Entrance entrance_m,
               double linearity);

  static constexpr std::string_view kName = "cahvore";
  static std::vector<ModelParameterSpec> parameter_specs();
  ModelParameters parameters() const;
  static CahvoreModel from_parameters(const ModelParameters& parameters);

  const CahvModel& cahv() const { return cahv_; }
  const Eigen::Vector3d& optical_axis() const { return given_axis_; }  ///< as passed to the constructor
  const Radial& radial() const { return radial_; }
  const Entrance& entrance_m() const { return entrance_; }
  double linearity() const { return linearity_; }
  double largest_angle() const { return largest_angle_; }  ///< upper bound of θ, rad
  /// Points up to this distance from C do not project, because rays intersect there, m; 0 if the pupil does not move or
  /// rays diverge.
  double nearest_m() const { return nearest_; }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point) const;
  std::optional<ProjectionWithJacobian> project_with_jacobian(const Eigen::Vector3d& point) const;
  /// The ray starts at the entrance pupil on the optical axis.
  std::optional<Ray> unproject(const Eigen::Vector2d& pixel) const;
  friend bool operator==(const CahvoreModel& a, const CahvoreModel& b) {
    return a.cahv_ == b.cahv_ && a.given_axis_ == b.given_axis_ && a.radial_ == b.radial_ &&
           a.entrance_ == b.entrance_ && a.linearity_ == b.linearity_;
  }

 private:
  struct AxialPoint;  // a point in cylindrical coordinates about the axis, with the off-axis angle of its ray
  std::optional<AxialPoint> axial_point_of(const Eigen::Vector3d& point) const;

  CahvModel cahv_;
  Eigen::Vector3d given_axis_, axis_;  ///< O as passed to the constructor, and normalized
  Radial radial_{};
  Entrance entrance_{};
  double linearity_ = 1;
  double largest_angle_ = 0, nearest_ = 0;
};

}  // namespace spartan
