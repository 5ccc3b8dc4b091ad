#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/guarded.h"
#include "bindings/map_layers.h"
#include "bindings/path_text.h"
#include "bindings/threads.h"
#include "spartan/system/map_files.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {
namespace {

using Window = std::tuple<double, double, double, double>;  // as Extent
using MapValue = Guarded<SavedMap>;

MapView view_of(SavedMap& saved, const std::optional<Window>& wanted) {
  GlobalMap& map = saved.map();
  if (!wanted) return value_of(map.view(map.extent()));
  const auto& [west, east, south, north] = *wanted;
  constexpr double kMost_m = 1e6;  // of a coordinate: the columns are counted by int
  for (const double each : {west, east, south, north}) {
    if (!(std::abs(each) < kMost_m)) {
      throw RaisedError(
          Error{ErrorCode::usage, "is not a rectangle of the world", "extent", "metres: west, east, south, north"});
    }
  }
  if (west >= east || south >= north)
    throw RaisedError(Error{ErrorCode::usage, "has no area", "extent", "the order is west, east, south, north"});
  return value_of(map.view(window_between(west, south, east, north, map.cell_m())));
}

std::unique_ptr<MapViewValue> make_view(MapValue& map, const std::optional<Window>& wanted) {
  return map.use([&](SavedMap& saved) {
    MapView seen = view_of(saved, wanted);
    Traversability shape = seen.shape(saved.options().mapping.map, ThreadPool(1));
    return std::make_unique<MapViewValue>(std::move(seen), std::move(shape));
  });
}

void export_to(MapValue& map, const PathText& path, const std::optional<Window>& wanted,
               const std::vector<std::string>& layers) {
  check(map.use([&](SavedMap& saved) -> Status {
    const auto format = map_format_of(path);
    if (!format) return failure(format);
    const MapView view = view_of(saved, wanted);
    const auto request = saved.request(view, *format, layers);
    return request ? export_map(view, *request, ThreadPool(1), path) : Status(failure(request));
  }));
}

void bind_parts(nb::module_& m) {
  nb::class_<MapViewValue> view(
      m, "MapView",
      "A rectangle of the global map. Layers are float32 of shape (rows, columns); row 0 lies in the north "
      "(largest y), NaN is unknown.");
  bind_layers(view);
  nb::class_<MapStop>(m, "MapStop", "A stop whose local map is part of a global map.")
      .def_ro("id", &MapStop::id)
      .def_prop_ro("stamp_ns", [](const MapStop& s) { return s.stamp.ns; })
      .def_ro("world_from_body", &MapStop::world_from_body);
  nb::class_<MapSample>(m, "MapSample", "The map at one position.")
      .def_ro("elevation_m", &MapSample::elevation_m)
      .def_ro("variance_m2", &MapSample::variance_m2)
      .def_ro("occupancy_logodds", &MapSample::occupancy_logodds)
      .def_prop_ro("kind",
                   [](const MapSample& s) { return class_categories()[static_cast<std::size_t>(s.kind)].name; });
}

}  // namespace

void bind_global_maps(nb::module_& m) {
  bind_parts(m);
  nb::class_<MapValue>(m, "GlobalMap",
                       "The global map of a run or of a map file; its tiles are read where they are needed.")
      .def_static(
          "open",
          [](const PathText& path) {
            const nb::gil_scoped_release free;
            return std::make_unique<MapValue>(value_of(SavedMap::open(path)));
          },
          "path"_a, "Opens the map of a run folder or a map file.")
      .def_prop_ro("cell_m", [](MapValue& map) { return map.use([](SavedMap& s) { return s.map().cell_m(); }); })
      .def_prop_ro(
          "extent",
          [](MapValue& map) {
            return map.use([](SavedMap& s) {
              const LatticeWindow all = s.map().extent();
              return extent_of(all.place(s.map().cell_m()), all.size());
            });
          },
          "(west, east, south, north) in m.")
      .def_prop_ro("stops", [](MapValue& map) { return map.use([](SavedMap& s) { return s.map().stops(); }); })
      .def("view", make_view, "extent"_a = nb::none(),
           "A rectangle (west, east, south, north) in m; without one the whole map. Raises Error where it has more "
           "than 8 "
           "million cells.")
      .def(
          "at",
          [](MapValue& map, double x, double y) {
            if (!(std::abs(x) < 1e6) || !(std::abs(y) < 1e6)) throw nb::value_error("x_m, y_m: must be within 1000 km");
            return map.use([&](SavedMap& s) { return value_of(s.map().at(x, y)); });
          },
          "x_m"_a, "y_m"_a, "The map at a position, interpolated; None where it is not known.")
      .def("export", export_to, "path"_a, "extent"_a = nb::none(), nb::kw_only(),
           "layers"_a = std::vector<std::string>(),
           "Writes a rectangle in the format of the extension: .tif (GeoTIFF), .png, .ply, .pcd, .bt (OctoMap), .glb "
           "(glTF mesh), .asc or .yaml "
           "(occupancy grid). `layers`: of a GeoTIFF or grid.")
      .def("__repr__", [](MapValue& map) {
        const auto [stops, tiles] =
            map.use([](SavedMap& s) { return std::pair(s.map().stops().size(), s.map().tiles()); });
        return fmt::format("<GlobalMap of {} stops, {} tiles>", stops, tiles);
      });
}

}  // namespace spartan::python
