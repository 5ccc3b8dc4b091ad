#include "spartan/rig/models/camera_model.h"

namespace spartan {
namespace {

using Radial = CahvorModel::Radial;

constexpr Radial kNoRadial{};
constexpr CahvoreModel::Entrance kNoEntrance{};

bool is_zero(const auto& coefficients) {
  for (const double c : coefficients) {
    if (c != 0) return false;
  }
  return true;
}

CameraModel simplest_equivalent(const PinholeModel& m) {
  return m;
}

CameraModel simplest_equivalent(const RadialTangentialModel& m) {
  if (is_zero(m.coefficients())) return m.pinhole();
  return m;
}

CameraModel simplest_equivalent(const EquidistantModel& m) {
  return m;
}

CameraModel simplest_equivalent(const DoubleSphereModel& m) {
  if (m.xi == 0 && m.alpha == 0) return m.pinhole;
  return m;
}

CameraModel simplest_equivalent(const CahvModel& m) {
  if (m.skew_px == 0) return m.core;
  return m;
}

// Whether the distortion is centred on z with r0 = 0 and there is no skew: the case that models without a separate
// optical axis can represent.
bool is_about_z(const CahvModel& cahv, const Eigen::Vector3d& axis, const Radial& radial) {
  return cahv.skew_px == 0 && axis == Eigen::Vector3d::UnitZ() && radial[0] == 0;
}

CameraModel simplest_equivalent(const CahvorModel& m) {
  if (m.radial() == kNoRadial) return simplest_equivalent(m.cahv());
  if (!is_about_z(m.cahv(), m.optical_axis(), m.radial())) return m;
  return RadialTangentialModel(m.cahv().core, {m.radial()[1], m.radial()[2]});
}

CameraModel simplest_equivalent(const CahvoreModel& m) {
  if (m.entrance_m() != kNoEntrance) return m;
  if (m.linearity() == 1) return simplest_equivalent(CahvorModel(m.cahv(), m.optical_axis(), m.radial()));
  if (m.linearity() != 0 || !is_about_z(m.cahv(), m.optical_axis(), m.radial())) return m;
  return EquidistantModel(m.cahv().core, {m.radial()[1], m.radial()[2], 0, 0});
}

template <class Model>
std::optional<Model> held(const CameraModel& model) {
  const Model* same = std::get_if<Model>(&model);
  return same ? std::optional(*same) : std::nullopt;
}

}  // namespace

CameraModel simplest_equivalent(const CameraModel& model) {
  return std::visit([](const auto& m) { return simplest_equivalent(m); }, model);
}

bool is_rational(const RadialTangentialModel& model) {
  const auto& k = model.coefficients();
  return k[5] != 0 || k[6] != 0 || k[7] != 0;
}

double skew_px(const CameraModel& model) {
  if (const auto* m = std::get_if<CahvModel>(&model)) return m->skew_px;
  if (const auto* m = std::get_if<CahvorModel>(&model)) return m->cahv().skew_px;
  if (const auto* m = std::get_if<CahvoreModel>(&model)) return m->cahv().skew_px;
  return 0;
}

CameraModel without_skew(const CameraModel& model) {
  if (const auto* m = std::get_if<CahvModel>(&model)) return CahvModel{m->core, 0};
  if (const auto* m = std::get_if<CahvorModel>(&model)) {
    return CahvorModel({m->cahv().core, 0}, m->optical_axis(), m->radial());
  }
  if (const auto* m = std::get_if<CahvoreModel>(&model)) {
    return CahvoreModel({m->cahv().core, 0}, m->optical_axis(), m->radial(), m->entrance_m(), m->linearity());
  }
  return model;
}

template <>
std::optional<PinholeModel> converted_to(const CameraModel& model) {
  return held<PinholeModel>(simplest_equivalent(model));
}

template <>
std::optional<RadialTangentialModel> converted_to(const CameraModel& model) {
  if (const auto pinhole = converted_to<PinholeModel>(model)) return RadialTangentialModel(*pinhole, {});
  return held<RadialTangentialModel>(simplest_equivalent(model));
}

template <>
std::optional<EquidistantModel> converted_to(const CameraModel& model) {
  return held<EquidistantModel>(simplest_equivalent(model));
}

template <>
std::optional<DoubleSphereModel> converted_to(const CameraModel& model) {
  if (const auto pinhole = converted_to<PinholeModel>(model)) return DoubleSphereModel{*pinhole, 0, 0};
  return held<DoubleSphereModel>(simplest_equivalent(model));
}

template <>
std::optional<CahvModel> converted_to(const CameraModel& model) {
  if (const auto pinhole = converted_to<PinholeModel>(model)) return CahvModel{*pinhole, 0};
  return held<CahvModel>(simplest_equivalent(model));
}

template <>
std::optional<CahvorModel> converted_to(const CameraModel& model) {
  if (const auto cahv = converted_to<CahvModel>(model)) return CahvorModel(*cahv, Eigen::Vector3d::UnitZ(), kNoRadial);
  if (const auto brown = converted_to<RadialTangentialModel>(model)) {
    const auto& k = brown->coefficients();
    if (RadialTangentialModel::Coefficients{k[0], k[1]} != k) return std::nullopt;
    return CahvorModel({brown->pinhole(), 0}, Eigen::Vector3d::UnitZ(), {0, k[0], k[1]});
  }
  return held<CahvorModel>(simplest_equivalent(model));
}

template <>
std::optional<CahvoreModel> converted_to(const CameraModel& model) {
  if (const auto cahvor = converted_to<CahvorModel>(model)) {
    return CahvoreModel(cahvor->cahv(), cahvor->optical_axis(), cahvor->radial(), kNoEntrance, 1);
  }
  if (const auto fisheye = converted_to<EquidistantModel>(model)) {
    const auto& k = fisheye->coefficients();
    if (k[2] != 0 || k[3] != 0) return std::nullopt;
    return CahvoreModel({fisheye->pinhole(), 0}, Eigen::Vector3d::UnitZ(), {0, k[0], k[1]}, kNoEntrance, 0);
  }
  return held<CahvoreModel>(simplest_equivalent(model));
}

}  // namespace spartan
