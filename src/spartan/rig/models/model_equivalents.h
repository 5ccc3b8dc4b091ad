// One camera under several names: which models say the same thing.
#pragma once

#include <optional>

#include "spartan/rig/models/camera_model.h"

namespace spartan {

/// The plainest model with the same projection; its numbers are those of the given one:
///   radial_tangential without coefficients, double_sphere with ξ = α = 0, cahv without skew      → pinhole
///   cahvor with r = 0 → cahv;  cahvor about z with r0 = 0, without skew                          → radial_tangential
///   cahvore with L = 1, e = 0 → cahvor;  with L = 0, e = 0 about z with r0 = 0, without skew     → equidistant
CameraModel plainest(const CameraModel& model);

/// Whether k4, k5 or k6 counts: what many formats have no place for.
bool is_rational(const RadialTangentialModel& model);

/// The skew of cahv, cahvor and cahvore, in pixels; 0 of models that have none.
double skew_px(const CameraModel& model);
/// The same model with rows and columns at right angles.
CameraModel without_skew(const CameraModel& model);

/// The same camera as a model of the wanted kind; none where that kind cannot say it.
template <class Model>
std::optional<Model> expressed_as(const CameraModel& model);

template <>
std::optional<PinholeModel> expressed_as(const CameraModel& model);
template <>
std::optional<RadialTangentialModel> expressed_as(const CameraModel& model);
template <>
std::optional<EquidistantModel> expressed_as(const CameraModel& model);
template <>
std::optional<DoubleSphereModel> expressed_as(const CameraModel& model);
template <>
std::optional<CahvModel> expressed_as(const CameraModel& model);
template <>
std::optional<CahvorModel> expressed_as(const CameraModel& model);
template <>
std::optional<CahvoreModel> expressed_as(const CameraModel& model);

}  // namespace spartan
