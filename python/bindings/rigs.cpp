#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <string>
#include <utility>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/camera_model.h"
#include "bindings/errors.h"
#include "bindings/pixel_format.h"
#include "spartan/rig/describe.h"
#include "spartan/rig/rig.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

using Size = std::pair<int, int>;

template <class Item>
const Item& named(const Item* found, const std::string& name) {
  if (found == nullptr) throw nb::key_error(name.c_str());
  return *found;
}

void bind_parts(nb::module_& m) {
  nb::class_<Camera>(m, "Camera", "One camera of a rig: its model, image size, and pose on its mount.")
      .def(
          "__init__",
          [](Camera* self, const std::string& name, const Size& size, const CameraModelValue& model,
             const std::string& layout, int bits, const std::string& alignment) {
            new (self) Camera{};
            self->name = name;
            self->size = {size.first, size.second};
            self->model = model.model;
            self->pixel_format = pixel_format(layout, bits, alignment);
          },
          "name"_a, "size"_a, "model"_a, nb::kw_only(), "layout"_a = "gray", "bits"_a = 8, "alignment"_a = "low",
          "`size`: (width, height) in pixels; `layout`, `bits` and `alignment`: of its images, see StereoFrame.")
      .def_ro("name", &Camera::name)
      .def_prop_ro(
          "size", [](const Camera& c) { return Size(c.size.width, c.size.height); }, "(width, height), px")
      .def_prop_ro("model", [](const Camera& c) { return CameraModelValue{c.model}; })
      .def_prop_ro(
          "layout", [](const Camera& c) { return std::string(name_of(c.pixel_format.layout)); },
          "`gray`, `rgb`, or a Bayer pattern such as `bayer_rggb`.")
      .def_prop_ro(
          "bits", [](const Camera& c) { return c.pixel_format.bits; }, "Significant bits of a sample.")
      .def_prop_ro(
          "alignment", [](const Camera& c) { return alignment_name(c.pixel_format); }, kAlignmentMeaning)
      .def_ro("mount", &Camera::mount, "`body` or the name of a pan-tilt unit.")
      .def_ro("mount_from_camera", &Camera::mount_from_camera)
      .def("__repr__", [](const Camera& c) {
        return fmt::format("<Camera '{}': {}, {}x{}>", c.name, name_of(c.model), c.size.width, c.size.height);
      });
  nb::class_<StereoPair>(m, "StereoPair", "Two cameras on the same mount that take synchronous images.")
      .def_ro("name", &StereoPair::name)
      .def_ro("left", &StereoPair::left, "Name of the left camera.")
      .def_ro("right", &StereoPair::right)
      .def_ro("nearest_m", &StereoPair::nearest_m, "Smallest depth to match, m; 0: not given.")
      .def_ro("for_odometry", &StereoPair::for_odometry, "False: used at stops only.")
      .def("__repr__",
           [](const StereoPair& p) { return fmt::format("<StereoPair '{}': {}, {}>", p.name, p.left, p.right); });
}

Rig stereo_rig(const Camera& left, const Camera& right, const Pose& right_from_left, const std::string& name) {
  Rig rig = rig_of_one_pair(name, left, right, right_from_left);
  check(rig.validate(name));
  return rig;
}

// The first pair on the body, and the IMU.
Rig mounted(const Rig& rig, const Pose& body_from_left, const std::optional<Pose>& body_from_imu) {
  Rig moved = rig;
  const StereoPair pair = rig.pairs.front();
  const Pose left_from_right = rig.right_from_left(pair).inverse();
  for (Camera& camera : moved.cameras) {
    if (camera.name != pair.left && camera.name != pair.right) continue;
    camera.mount = "body";
    camera.mount_from_camera = camera.name == pair.left ? body_from_left : body_from_left * left_from_right;
  }
  if (body_from_imu) moved.imu.body_from_imu = *body_from_imu;
  moved.convention = PoseConvention::body;
  check(moved.validate(rig.name));
  return moved;
}

}  // namespace

void bind_rigs(nb::module_& m) {
  bind_parts(m);
  nb::class_<Rig>(
      m, "Rig",
      "All cameras of a rover and their geometry. The body frame is x forward, y left, z up. To change a rig, "
      "change its YAML.")
      .def_static(
          "stereo", stereo_rig, "left"_a, "right"_a, "right_from_left"_a, "name"_a = "stereo",
          "A rig of two cameras; the body is the left camera turned to x forward, y left, z up. Raises Error where "
          "the rig is not possible.")
      .def_static(
          "from_yaml", [](const std::string& text) { return value_of(parse_rig_yaml(text, "rig.yaml")); }, "text"_a,
          "Reads a rig.yaml. Raises Error with all faults of the text.")
      .def(
          "to_yaml", [](const Rig& r) { return to_rig_yaml(r); },
          "The rig as rig.yaml; from_yaml() restores it bit for bit.")
      .def(
          "mounted", mounted, "body_from_left"_a, "body_from_imu"_a = nb::none(),
          "The same rig with another pose of its first pair on the body, and of the IMU, whose readings have its axes.")
      .def_prop_ro(
          "track_m", [](const Rig& r) { return r.rover.track_m; }, "Distance between left and right wheels, m.")
      .def_ro("name", &Rig::name)
      .def_prop_ro("cameras", [](const Rig& r) { return r.cameras; })
      .def_prop_ro("pairs", [](const Rig& r) { return r.pairs; })
      .def(
          "camera", [](const Rig& r, const std::string& name) { return named(r.find_camera(name), name); }, "name"_a,
          "Raises KeyError for an unknown name.")
      .def(
          "pair", [](const Rig& r, const std::string& name) { return named(r.find_pair(name), name); }, "name"_a,
          "Raises KeyError for an unknown name.")
      .def(
          "body_from_camera",
          [](const Rig& r, const std::string& name, const std::optional<double>& pan,
             const std::optional<double>& tilt) {
            named(r.find_camera(name), name);
            return pan || tilt ? r.body_from_camera(name, pan.value_or(0), tilt.value_or(0)) : r.body_from_camera(name);
          },
          "camera"_a, "pan_rad"_a = nb::none(), "tilt_rad"_a = nb::none(),
          "Pose of a camera, at the rest angles of its pan-tilt unit or at the given ones.")
      .def(
          "right_from_left",
          [](const Rig& r, const std::string& pair) { return r.right_from_left(named(r.find_pair(pair), pair)); },
          "pair"_a)
      .def(
          "baseline_m",
          [](const Rig& r, const std::string& pair) {
            return r.right_from_left(named(r.find_pair(pair), pair)).translation().norm();
          },
          "pair"_a, "Distance of the two cameras of a pair, m.")
      .def(
          "describe", [](const Rig& r) { return describe_rig(r); }, "Lines of text about every camera and pair.")
      .def(
          "__eq__", [](const Rig& a, const Rig& b) { return a == b; }, nb::is_operator(),
          nb::sig("def __eq__(self, other: object, /) -> bool"))
      .def("__getstate__", [](const Rig& r) { return to_rig_yaml(r); })
      .def("__setstate__",
           [](Rig* self, const std::string& yaml) { new (self) Rig(value_of(parse_rig_yaml(yaml, "pickled rig"))); })
      .def("__repr__", [](const Rig& r) {
        return fmt::format("<Rig '{}': {} cameras, {} pairs>", r.name, r.cameras.size(), r.pairs.size());
      });
}

}  // namespace spartan::python
