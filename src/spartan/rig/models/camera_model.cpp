#include "spartan/rig/models/camera_model.h"

#include <type_traits>
#include <utility>

namespace spartan {
namespace {

// Every model of the variant, with its default parameters.
template <std::size_t... I>
std::vector<CameraModel> all_models(std::index_sequence<I...>) {
  return {CameraModel(std::in_place_index<I>)...};
}
std::vector<CameraModel> all_models() {
  return all_models(std::make_index_sequence<std::variant_size_v<CameraModel>>());
}

}  // namespace

std::string_view name_of(const CameraModel& model) {
  return std::visit([](const auto& m) { return std::decay_t<decltype(m)>::kName; }, model);
}

std::vector<ModelParameterSpec> parameter_specs(const CameraModel& model) {
  return std::visit([](const auto& m) { return std::decay_t<decltype(m)>::parameter_specs(); }, model);
}

ModelParameters parameters(const CameraModel& model) {
  return std::visit([](const auto& m) { return m.parameters(); }, model);
}

std::optional<CameraModel> camera_model_named(std::string_view name) {
  for (const CameraModel& model : all_models()) {
    if (name_of(model) == name) return model;
  }
  return std::nullopt;
}

CameraModel with_parameters(const CameraModel& model, const ModelParameters& numbers) {
  return std::visit([&](const auto& m) -> CameraModel { return std::decay_t<decltype(m)>::from_parameters(numbers); },
                    model);
}

std::vector<std::string_view> camera_model_names() {
  std::vector<std::string_view> names;
  for (const CameraModel& model : all_models()) names.push_back(name_of(model));
  return names;
}

}  // namespace spartan
