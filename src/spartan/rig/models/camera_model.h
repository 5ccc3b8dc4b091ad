// Camera models: projection, unprojection, Jacobians, and conversion between them. A new model is a class here with the
// members of the others, one source file, and one entry in `CameraModel` (CONTRIBUTING.md, "A camera model").
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

namespace spartan {

/// A viewing ray in the camera frame (x right, y down, z forward): origin in m, unit direction. The origin is zero for
/// central models.
struct Ray {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();
};

/// A pixel with its Jacobian by the point, ∂(u, v)/∂(x, y, z), in px/m.
struct ProjectionWithJacobian {
  Eigen::Vector2d pixel;
  Eigen::Matrix<double, 2, 3> by_point;
};

/// One parameter of a model: a key in rig.yaml that holds a list of numbers.
struct ModelParameterSpec {
  std::string_view key;     ///< with its unit: "focal_px"
  std::vector<int> counts;  ///< the allowed numbers of values
  bool positive = false;    ///< each value must be positive; all must be finite in any case
  /// Bounds of each value, inclusive.
  double least = -std::numeric_limits<double>::infinity(), most = std::numeric_limits<double>::infinity();
  bool unit_length = false;  ///< the values are a unit vector (within 0.001)
};

/// The values of a model: one list for each ModelParameterSpec, in the same order.
using ModelParameters = std::vector<std::vector<double>>;

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

/// One of the supported camera models.
using CameraModel = std::variant<PinholeModel, RadialTangentialModel, EquidistantModel, DoubleSphereModel, CahvModel,
                                 CahvorModel, CahvoreModel>;

/// The pixel of a point in the camera frame (m); nullopt outside of the domain of the model.
inline std::optional<Eigen::Vector2d> project(const CameraModel& model, const Eigen::Vector3d& point) {
  return std::visit([&](const auto& m) { return m.project(point); }, model);
}
/// The pixel and its 2×3 Jacobian by the point.
inline std::optional<ProjectionWithJacobian> project_with_jacobian(const CameraModel& model,
                                                                   const Eigen::Vector3d& point) {
  return std::visit([&](const auto& m) { return m.project_with_jacobian(point); }, model);
}
/// The ray of a pixel in the camera frame; nullopt if no ray of the domain projects to the pixel.
inline std::optional<Ray> unproject(const CameraModel& model, const Eigen::Vector2d& pixel) {
  return std::visit([&](const auto& m) { return m.unproject(pixel); }, model);
}

/// The name of the model in rig.yaml: "pinhole", "radial_tangential", "equidistant" ….
std::string_view name_of(const CameraModel& model);

/// The parameters of a model as rig.yaml stores them: the description of each key, and the values in the same order.
std::vector<ModelParameterSpec> parameter_specs(const CameraModel& model);
ModelParameters parameters(const CameraModel& model);

/// A model of that name with default parameters; nullopt if the name is unknown.
std::optional<CameraModel> camera_model_named(std::string_view name);
/// The same type of model with other parameter values, whose counts must match parameter_specs().
CameraModel with_parameters(const CameraModel& model, const ModelParameters& numbers);
/// The names of all models, for error messages.
std::vector<std::string_view> camera_model_names();

/// The simplest model with exactly the same projection; parameter values are copied unchanged:
///   radial_tangential without coefficients, double_sphere with ξ = α = 0, cahv without skew      → pinhole
///   cahvor with r = 0 → cahv;  cahvor about z with r0 = 0, without skew                          → radial_tangential
///   cahvore with L = 1, e = 0 → cahvor;  with L = 0, e = 0 about z with r0 = 0, without skew     → equidistant
CameraModel simplest_equivalent(const CameraModel& model);

/// Whether k4, k5 or k6 is not zero: the rational model, which many formats do not support.
bool is_rational(const RadialTangentialModel& model);

/// The skew of cahv, cahvor and cahvore, px; 0 for models without skew.
double skew_px(const CameraModel& model);
/// The same model with zero skew.
CameraModel without_skew(const CameraModel& model);

/// Converts to another type of model with exactly the same projection; nullopt if that type cannot represent it.
template <class Model>
std::optional<Model> converted_to(const CameraModel& model);

template <>
std::optional<PinholeModel> converted_to(const CameraModel& model);
template <>
std::optional<RadialTangentialModel> converted_to(const CameraModel& model);
template <>
std::optional<EquidistantModel> converted_to(const CameraModel& model);
template <>
std::optional<DoubleSphereModel> converted_to(const CameraModel& model);
template <>
std::optional<CahvModel> converted_to(const CameraModel& model);
template <>
std::optional<CahvorModel> converted_to(const CameraModel& model);
template <>
std::optional<CahvoreModel> converted_to(const CameraModel& model);

}  // namespace spartan
