// CAHVOR: CAHV with radial distortion about a separate optical axis, the camera model of the Mars rovers.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "spartan/rig/models/cahv.h"

namespace spartan {

/// With P relative to C, ω = P·O, λ = P − ω O, τ = λ·λ/ω²:
///   μ = r0 + r1 τ + r2 τ²,  P' = P + μ λ,  (u, v) = CAHV of P'
/// Source: Gennery, "Least-squares camera calibration including lens distortion and automatic editing of calibration
/// points", in Calibration and Orientation of Cameras in Computer Vision, 2001; frame as in cahv.h.
/// Domain: ω > 0, √τ below the radius where √τ (1 + μ) stops increasing, P' in front of the camera (z > 0).
class CahvorModel {
 public:
  using Radial = std::array<double, 3>;

  CahvorModel() : CahvorModel({}, Eigen::Vector3d::UnitZ(), {}) {}
  /// `optical_axis`: the unit vector O in the camera frame. `radial`: r0, r1, r2.
  CahvorModel(CahvModel cahv, const Eigen::Vector3d& optical_axis, Radial radial);

  static constexpr std::string_view kName = "cahvor";
  static std::vector<ModelParameterSpec> parameter_specs();
  ModelParameters parameters() const;
  static CahvorModel from_parameters(const ModelParameters& parameters);

  const CahvModel& cahv() const { return cahv_; }
  const Eigen::Vector3d& optical_axis() const { return given_axis_; }  ///< as passed to the constructor
  const Radial& radial() const { return radial_; }
  /// Upper bound of √τ; infinity if the radial map increases everywhere.
  double largest_radius() const { return largest_radius_; }

  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point) const;
  std::optional<ProjectionWithJacobian> project_with_jacobian(const Eigen::Vector3d& point) const;
  std::optional<Ray> unproject(const Eigen::Vector2d& pixel) const;
  friend bool operator==(const CahvorModel& a, const CahvorModel& b) {
    return a.cahv_ == b.cahv_ && a.given_axis_ == b.given_axis_ && a.radial_ == b.radial_;
  }

 private:
  CahvModel cahv_;
  Eigen::Vector3d given_axis_, axis_;  ///< O as passed to the constructor, and normalized
  Radial radial_{};
  double largest_radius_ = 0;
};

namespace rig_detail {

/// The smallest positive root of d(x (1 + r0 + r1 x² + r2 x⁴))/dx, where the radial map of CAHVOR and CAHVORE stops
/// increasing. Infinity if there is none; 0 if the map decreases at 0 or a coefficient is not finite.
double cahvor_monotonic_limit(const CahvorModel::Radial& radial);

}  // namespace rig_detail

}  // namespace spartan
