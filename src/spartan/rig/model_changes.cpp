#include "spartan/rig/model_changes.h"

#include <algorithm>
#include <functional>
#include <initializer_list>

namespace spartan {
namespace {

// The numbers of a model with those of the named keys changed.
CameraModel with_changed(const CameraModel& model, std::initializer_list<std::string_view> keys,
                         const std::function<double(double)>& change) {
  const auto kinds = parameter_kinds(model);
  ModelParameters numbers = parameters(model);
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    if (std::find(keys.begin(), keys.end(), kinds[i].key) == keys.end()) continue;
    for (double& v : numbers[i]) v = change(v);
  }
  return with_parameters(model, numbers);
}

}  // namespace

CameraModel with_focal_times(const CameraModel& model, double factor) {
  return with_changed(model, {"focal_px", "skew_px"}, [&](double v) { return v * factor; });
}

CameraModel resized(const CameraModel& model, double factor) {
  return with_changed(with_focal_times(model, factor), {"centre_px"},
                      [&](double v) { return (v + 0.5) * factor - 0.5; });
}

CameraModel with_radial(const CameraModel& model, double k) {
  const auto* pinhole = std::get_if<PinholeModel>(&model);
  const auto* radial = std::get_if<RadialTangentialModel>(&model);
  if (!pinhole && !radial) return model;
  // r_u = r_d/(1 + k r_d²) gives r_d = r_u (1 + k r_u² + 2 k² r_u⁴ + …).
  return RadialTangentialModel(pinhole ? *pinhole : radial->pinhole(), {k, 2 * k * k});
}

}  // namespace spartan
