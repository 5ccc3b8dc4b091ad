#include "bindings/point_clouds.h"

#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <cstddef>
#include <string>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/path_text.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

static_assert(sizeof(ColouredPoint) % sizeof(double) == 0);

// A field of all points, without a copy: its values are as far apart as the points.
template <class T>
nb::object column(const nb::handle& self, std::size_t offset, std::size_t columns) {
  const auto& points = nb::inst_ptr<PointCloudValue>(self)->points;
  static const ColouredPoint kNone{};
  const auto* const first = reinterpret_cast<const char*>(points.empty() ? &kNone : points.data()) + offset;
  static_assert(sizeof(ColouredPoint) % sizeof(T) == 0);
  const std::array<std::size_t, 2> shape{points.size(), columns};
  const std::array<std::int64_t, 2> strides{sizeof(ColouredPoint) / sizeof(T), 1};
  return nb::cast(nb::ndarray<nb::numpy, const T>(reinterpret_cast<const T*>(first), columns == 1 ? 1 : 2, shape.data(),
                                                  self, strides.data()));
}

PointCloudValue from_disparity(const AnyArray& disparity, const AnyArray& sigma, const AnyArray& left,
                               const RectifiedStereo& geometry, const Pose& target_from_left, std::int64_t stamp,
                               int step_px, double max_range_m) {
  const auto d = image_view<float>(disparity, "disparity");
  const auto s = image_view<float>(sigma, "sigma");
  const auto gray = image_view<std::uint8_t>(left, "left");
  if (d.size() != s.size() || d.size() != gray.size())
    throw nb::value_error("disparity, sigma and left must have one shape");
  if (step_px < 1) throw nb::value_error("step_px: must be at least 1");
  CloudSampling sampling;
  sampling.step_px = step_px;
  sampling.max_range_m = max_range_m;
  const nb::gil_scoped_release free;
  return {to_point_cloud(d, s, gray, geometry, target_from_left, Stamp{stamp}, sampling)};
}

void save(const PointCloudValue& cloud, const PathText& path) {
  if (path.ends_with(".ply")) return check(write_ply(path, cloud.points));
  if (path.ends_with(".pcd")) return check(write_pcd(path, cloud.points));
  throw nb::value_error("path: must end with .ply or .pcd");
}

}  // namespace

void bind_point_clouds(nb::module_& m) {
  nb::class_<PointCloudValue>(m, "PointCloud", "Coloured points with the standard deviation of their range.")
      .def_static(
          "from_disparity", from_disparity, "disparity"_a, "sigma"_a, "left"_a, "geometry"_a,
          "target_from_left"_a = Pose(), "stamp_ns"_a = 0, nb::kw_only(), "step_px"_a = 1, "max_range_m"_a = 0.0,
          "Triangulates the pixels of a disparity image (float32, px) with their sigma; colours are gray levels of the "
          "rectified left image. `target_from_left` moves the points. `max_range_m`: 0 is no limit.")
      .def_static(
          "load", [](const PathText& path) { return PointCloudValue{value_of(read_ply(path))}; }, "path"_a,
          "Reads a PLY file that Spartan wrote.")
      .def("save", save, "path"_a, "Writes a binary PLY or PCD file, by the extension.")
      .def_prop_ro(
          "positions", [](const nb::handle& self) { return column<float>(self, offsetof(ColouredPoint, position), 3); },
          nb::sig("def positions(self) -> numpy.typing.NDArray[numpy.float32]"), "Metres, float32, shape (n, 3).")
      .def_prop_ro(
          "colours",
          [](const nb::handle& self) { return column<std::uint8_t>(self, offsetof(ColouredPoint, colour), 3); },
          nb::sig("def colours(self) -> numpy.typing.NDArray[numpy.uint8]"), "RGB, uint8, shape (n, 3).")
      .def_prop_ro(
          "sigma_m", [](const nb::handle& self) { return column<float>(self, offsetof(ColouredPoint, sigma_m), 1); },
          nb::sig("def sigma_m(self) -> numpy.typing.NDArray[numpy.float32]"),
          "Standard deviation of the range, of map cells of the elevation; m, shape (n,).")
      .def_prop_ro(
          "times_s", [](const nb::handle& self) { return column<double>(self, offsetof(ColouredPoint, time_s), 1); },
          nb::sig("def times_s(self) -> numpy.typing.NDArray[numpy.float64]"),
          "Time of the image of each point, s, shape (n,).")
      .def("__len__", [](const PointCloudValue& c) { return c.points.size(); })
      .def("__repr__",
           [](const PointCloudValue& c) { return fmt::format("<PointCloud of {} points>", c.points.size()); });
}

}  // namespace spartan::python
