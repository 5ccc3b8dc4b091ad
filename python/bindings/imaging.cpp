#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>

#include <optional>
#include <utility>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/guarded.h"
#include "bindings/path_text.h"
#include "bindings/rectified_pair.h"
#include "bindings/threads.h"
#include "spartan/imaging/imager.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {

RectifiedPairValue owned(const RectifiedPair& pair) {
  RectifiedPairValue value{Image<std::uint8_t>::copy_of(pair.left), Image<std::uint8_t>::copy_of(pair.right),
                           Image<std::uint8_t>::copy_of(pair.left_mask), Image<std::uint8_t>::copy_of(pair.right_mask),
                           pair};
  value.pair.left = value.left.view();
  value.pair.right = value.right.view();
  value.pair.left_mask = value.left_mask.view();
  value.pair.right_mask = value.right_mask.view();
  return value;
}

namespace {

// The view of an image, which the object keeps; None for an empty one.
nb::object part(const nb::handle& self, const Image<std::uint8_t>& image) {
  return image.empty() ? nb::none() : nb::cast(shared_array<std::uint8_t>(image.view(), self));
}

const RectifiedPairValue& value_in(const nb::handle& self) {
  return *nb::inst_ptr<RectifiedPairValue>(self);
}

RectifiedStereo make_geometry(std::pair<int, int> size, double focal_px, const NumberArray& centre, double baseline_m) {
  if (size.first <= 0 || size.second <= 0 || !(focal_px > 0) || !(baseline_m > 0))
    throw nb::value_error("size, focal_px and baseline_m must be positive");
  return {{size.first, size.second}, focal_px, vector_of<2>(centre, "centre_px"), baseline_m};
}

// Points (n, 3) of (u, v, d).
RowsArray<double, 3> triangulate(const RectifiedStereo& g, const NumberArray& pixels) {
  const Rows rows(pixels, 3, "uvd");
  std::vector<double> points(3 * rows.count());
  for (std::size_t i = 0; i < rows.count(); ++i) {
    const Eigen::Vector3d uvd = rows.row<3>(i);
    Eigen::Map<Eigen::Vector3d>(points.data() + 3 * i) =
        uvd.z() > 0 ? g.triangulate(uvd.x(), uvd.y(), uvd.z()) : Eigen::Vector3d::Constant(std::nan("")).eval();
  }
  return owned_rows<3>(std::move(points));
}

// Depth in metres of each pixel of a disparity image; NaN where there is none.
ImageArray<float> depth(const RectifiedStereo& g, const AnyArray& disparity) {
  const ImageView<const float> d = image_view<float>(disparity, "disparity");
  Image<float> z(d.size());
  {
    const nb::gil_scoped_release free;
    const double scale = g.focal_px * g.baseline_m;
    for (int y = 0; y < d.height(); ++y) {
      for (int x = 0; x < d.width(); ++x)
        z(x, y) = d(x, y) > 0 ? static_cast<float>(scale / static_cast<double>(d(x, y))) : std::nanf("");
    }
  }
  return owned_array(std::move(z));
}

void bind_geometry(nb::module_& m) {
  nb::class_<RectifiedStereo>(
      m, "RectifiedStereo",
      "Geometry of a rectified pair: two equal pinholes with common rows, the right one baseline_m "
      "along +x of the left one. d = u_left - u_right = focal_px * baseline_m / z.")
      .def(
          "__init__",
          [](RectifiedStereo* self, std::pair<int, int> size, double focal, const NumberArray& centre,
             double baseline) { new (self) RectifiedStereo(make_geometry(size, focal, centre, baseline)); },
          "size"_a, "focal_px"_a, "centre_px"_a, "baseline_m"_a, "`size`: (width, height), px.")
      .def_prop_ro(
          "size", [](const RectifiedStereo& g) { return std::pair(g.size.width, g.size.height); },
          "(width, height), px")
      .def_ro("focal_px", &RectifiedStereo::focal_px)
      .def_prop_ro(
          "centre_px", [](const RectifiedStereo& g) { return matrix_array(g.centre_px); }, nb::rv_policy::automatic)
      .def_ro("baseline_m", &RectifiedStereo::baseline_m)
      .def("triangulate", triangulate, "uvd"_a,
           "Points of the left optical frame (m) of pixels and disparities (u, v, d), both of shape (n, 3); NaN for d "
           "<= 0.")
      .def("depth", depth, "disparity"_a,
           "Depth z in metres of each pixel of a disparity image (float32, px); NaN where it is unknown.")
      .def("__repr__", [](const RectifiedStereo& g) {
        return fmt::format("<RectifiedStereo {}x{}, f = {:.2f} px, baseline {:.4f} m>", g.size.width, g.size.height,
                           g.focal_px, g.baseline_m);
      });
}

}  // namespace

void bind_imaging(nb::module_& m) {
  bind_geometry(m);
  nb::class_<RectifiedPairValue>(m, "RectifiedPair", "Two rectified images with common rows, 8-bit gray.")
      .def(
          "__init__",
          [](RectifiedPairValue* self, const AnyArray& left, const AnyArray& right, const RectifiedStereo& geometry,
             std::int64_t stamp, const std::string& pair) {
            RectifiedPair views;
            views.pair = pair;
            views.stamp = {stamp};
            views.geometry = geometry;
            views.left = image_view<std::uint8_t>(left, "left");
            views.right = image_view<std::uint8_t>(right, "right");
            if (views.left.size() != geometry.size || views.right.size() != geometry.size)
              throw nb::value_error("left, right: must have the size of the geometry");
            new (self) RectifiedPairValue(owned(views));
          },
          "left"_a, "right"_a, "geometry"_a, "stamp_ns"_a, "pair"_a = "stereo",
          "Of images that are rectified already, uint8; they are copied.")
      .def_prop_ro(
          "pair", [](const RectifiedPairValue& p) { return p.pair.pair; }, "Name of the stereo pair.")
      .def_prop_ro("stamp_ns", [](const RectifiedPairValue& p) { return p.pair.stamp.ns; })
      .def_prop_ro("geometry", [](const RectifiedPairValue& p) { return p.pair.geometry; })
      .def_prop_ro(
          "body_from_left", [](const RectifiedPairValue& p) { return p.pair.body_from_left; },
          "Pose of the rectified left optical frame, at the pan and tilt of this frame.")
      .def_prop_ro(
          "left", [](const nb::handle& self) { return part(self, value_in(self).left); },
          nb::sig("def left(self) -> numpy.typing.NDArray[numpy.uint8]"), "uint8, shape (height, width)")
      .def_prop_ro(
          "right", [](const nb::handle& self) { return part(self, value_in(self).right); },
          nb::sig("def right(self) -> numpy.typing.NDArray[numpy.uint8]"), "uint8, shape (height, width)")
      .def_prop_ro(
          "left_mask", [](const nb::handle& self) { return part(self, value_in(self).left_mask); },
          nb::sig("def left_mask(self) -> numpy.typing.NDArray[numpy.uint8] | None"),
          "255 where a pixel shows the world, 0 elsewhere; None: everywhere.")
      .def_prop_ro(
          "right_mask", [](const nb::handle& self) { return part(self, value_in(self).right_mask); },
          nb::sig("def right_mask(self) -> numpy.typing.NDArray[numpy.uint8] | None"), "As left_mask.");
  nb::class_<Guarded<Imager>>(m, "Imager", "Imaging: from raw camera images to rectified gray pairs.")
      .def(
          "__init__",
          [](Guarded<Imager>* self, const Rig& rig, const ImagingOptions* options, std::optional<int> threads,
             const PathText& masks) {
            const ImagingOptions chosen = options == nullptr ? ImagingOptions() : *options;
            const ThreadPool workers = thread_pool(threads);
            const nb::gil_scoped_release free;
            new (self) Guarded<Imager>(value_of(Imager::create(rig, chosen, workers, masks)));
          },
          "rig"_a, "options"_a.none() = nb::none(), nb::kw_only(), "threads"_a = nb::none(), "mask_folder"_a = "",
          "`threads`: None is all cores. `mask_folder`: of the rig file, for its self-masks. Raises Error where a pair "
          "cannot be rectified.")
      .def(
          "process",
          [](Guarded<Imager>& self, const StereoFrame& frame) {
            return self.use([&](Imager& imager) { return owned(value_of(imager.process(frame))); });
          },
          "frame"_a, "Rectifies a frame. Raises Error with the code `frame_rejected` where it does not fit the rig.")
      .def(
          "geometry",
          [](Guarded<Imager>& self, const std::string& pair) {
            try {
              return self.use([&](const Imager& imager) { return imager.geometry(pair); });
            } catch (const std::exception&) {
              throw nb::key_error(pair.c_str());
            }
          },
          "pair"_a, "Geometry of the rectified images of a pair. Raises KeyError.");
}

}  // namespace spartan::python
