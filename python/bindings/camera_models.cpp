#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/camera_model.h"
#include "spartan/rig/models/camera_model.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::vector<double> values_of(const nb::handle& given, const ModelParameterSpec& spec) {
  const std::string key(spec.key);
  std::vector<double> values;
  const bool one = PyFloat_Check(given.ptr()) || PyLong_Check(given.ptr());
  if (one ? false : !nb::try_cast(given, values)) throw nb::type_error((key + ": must be a list of numbers").c_str());
  if (one) values = {nb::cast<double>(given)};
  bool fits = false;
  std::string counts;
  for (const int count : spec.counts) {
    fits = fits || static_cast<int>(values.size()) == count;
    counts += (counts.empty() ? "" : " or ") + std::to_string(count);
  }
  if (!fits) throw nb::value_error(fmt::format("{}: must have {} values, not {}", key, counts, values.size()).c_str());
  for (const double v : values) {
    if (!std::isfinite(v) || v < spec.least || v > spec.most || (spec.positive && v <= 0))
      throw nb::value_error(fmt::format("{}: {} is not possible", key, v).c_str());
  }
  return values;
}

CameraModelValue make_model(const std::string& kind, const nb::kwargs& given) {
  const auto empty = camera_model_named(kind);
  if (!empty) {
    std::string names;
    for (const auto name : camera_model_names()) names += (names.empty() ? "" : ", ") + std::string(name);
    throw nb::value_error(fmt::format("there is no camera model '{}'; models: {}", kind, names).c_str());
  }
  ModelParameters numbers = parameters(*empty);
  const auto specs = parameter_specs(*empty);
  std::size_t used = 0;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const std::string key(specs[i].key);
    if (!given.contains(key.c_str())) throw nb::type_error(fmt::format("{}: {} is missing", kind, key).c_str());
    numbers[i] = values_of(given[key.c_str()], specs[i]);
    ++used;
  }
  if (used != given.size()) throw nb::type_error(fmt::format("{}: has other parameters", kind).c_str());
  return {with_parameters(*empty, numbers)};
}

nb::dict parameter_values(const CameraModelValue& m) {
  nb::dict values;
  const auto specs = parameter_specs(m.model);
  const auto numbers = parameters(m.model);
  for (std::size_t i = 0; i < specs.size(); ++i) values[std::string(specs[i].key).c_str()] = nb::cast(numbers[i]);
  return values;
}

RowsArray<double, 2> project_points(const CameraModelValue& m, const NumberArray& points) {
  const Rows rows(points, 3, "points");
  std::vector<double> pixels(2 * rows.count(), kNone);
  {
    const nb::gil_scoped_release free;
    for (std::size_t i = 0; i < rows.count(); ++i) {
      if (const auto pixel = project(m.model, rows.row<3>(i))) {
        pixels[2 * i] = pixel->x();
        pixels[2 * i + 1] = pixel->y();
      }
    }
  }
  return owned_rows<2>(std::move(pixels));
}

nb::ndarray<nb::numpy, double, nb::shape<-1, 2, 3>> project_jacobians(const CameraModelValue& m,
                                                                      const NumberArray& points) {
  const Rows rows(points, 3, "points");
  const auto [values, owner] = kept_by_python(std::vector<double>(6 * rows.count(), kNone));
  for (std::size_t i = 0; i < rows.count(); ++i) {
    if (const auto projection = project_with_jacobian(m.model, rows.row<3>(i)))
      Eigen::Map<Eigen::Matrix<double, 2, 3, Eigen::RowMajor>>(values->data() + 6 * i) = projection->by_point;
  }
  return {values->data(), {rows.count(), 2, 3}, owner};
}

std::tuple<RowsArray<double, 3>, RowsArray<double, 3>> unproject_pixels(const CameraModelValue& m,
                                                                        const NumberArray& pixels) {
  const Rows rows(pixels, 2, "pixels");
  std::vector<double> origins(3 * rows.count(), kNone), directions(3 * rows.count(), kNone);
  {
    const nb::gil_scoped_release free;
    for (std::size_t i = 0; i < rows.count(); ++i) {
      if (const auto ray = unproject(m.model, rows.row<2>(i))) {
        Eigen::Map<Eigen::Vector3d>(origins.data() + 3 * i) = ray->origin;
        Eigen::Map<Eigen::Vector3d>(directions.data() + 3 * i) = ray->direction;
      }
    }
  }
  return {owned_rows<3>(std::move(origins)), owned_rows<3>(std::move(directions))};
}

std::string repr(const CameraModelValue& m) {
  std::string text;
  const auto specs = parameter_specs(m.model);
  const auto numbers = parameters(m.model);
  for (std::size_t i = 0; i < specs.size(); ++i)
    text += fmt::format(", {}=[{}]", specs[i].key, fmt::join(numbers[i], ", "));
  return fmt::format("CameraModel('{}'{})", name_of(m.model), text);
}

}  // namespace

void bind_camera_models(nb::module_& m) {
  nb::class_<CameraModelValue>(m, "CameraModel",
                               "How a camera maps points of its optical frame (x right, y down, z forward) to pixels.")
      .def(
          "__init__",
          [](CameraModelValue* self, const std::string& kind, const nb::kwargs& values) {
            new (self) CameraModelValue(make_model(kind, values));
          },
          nb::sig("def __init__(self, kind: str, **parameters: object) -> None"),
          "A model of rig.yaml with its parameters: `CameraModel('pinhole', focal_px=[700, 700], centre_px=[320, "
          "240])`.")
      .def_prop_ro(
          "kind", [](const CameraModelValue& c) { return std::string(name_of(c.model)); },
          "Name of the model in rig.yaml.")
      .def_prop_ro("parameters", parameter_values, nb::sig("def parameters(self) -> dict[str, list[float]]"),
                   "The values under the keys of rig.yaml.")
      .def("project", project_points, "points"_a,
           "Points in the optical frame, shape (n, 3), in metres, to pixels, shape (n, 2). Integer coordinates are "
           "pixel "
           "centres. NaN where a point is outside of the domain of the model.")
      .def("project_jacobian", project_jacobians, "points"_a,
           "Derivatives of the pixels by the points, shape (n, 2, 3), px/m. NaN outside of the domain.")
      .def("unproject", unproject_pixels, "pixels"_a,
           "Pixels, shape (n, 2), to rays: origins (m; zero for central cameras) and unit directions, both of shape "
           "(n, 3). NaN where no ray of the domain has that pixel.")
      .def_static(
          "kinds",
          [] {
            std::vector<std::string> names;
            for (const auto name : camera_model_names()) names.emplace_back(name);
            return names;
          },
          "The names of all models.")
      .def(
          "__eq__", [](const CameraModelValue& a, const CameraModelValue& b) { return a.model == b.model; },
          nb::is_operator(), nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__repr__", repr);
}

}  // namespace spartan::python
