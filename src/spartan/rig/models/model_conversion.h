// Exact conversion between camera models.
#pragma once

#include <optional>

#include "spartan/rig/models/camera_model.h"

namespace spartan {

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
