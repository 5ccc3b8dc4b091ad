#include <fmt/format.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "bindings/arrays.h"
#include "bindings/bindings.h"
#include "bindings/errors.h"
#include "bindings/guarded.h"
#include "bindings/map_layers.h"
#include "bindings/path_text.h"
#include "bindings/rectified_pair.h"
#include "bindings/threads.h"
#include "spartan/core/files.h"
#include "spartan/reconstruction/rendering.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "spartan/system/map_files.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace spartan::python {

Extent extent_of(const GeoTransform& place, ImageSize size) {
  return {place.west_m, place.west_m + size.width * place.cell_m, place.north_m - size.height * place.cell_m,
          place.north_m};
}

nb::dict layers_of(const MapBands& bands, const nb::handle& owner) {
  nb::dict layers;
  for (const MapBand& band : bands.list) layers[band.name.c_str()] = nb::cast(shared_array<float>(band.values, owner));
  return layers;
}

nb::object layer_of(const MapBands& bands, const std::string& name, const nb::handle& owner) {
  for (const MapBand& band : bands.list) {
    if (band.name == name) return nb::cast(shared_array<float>(band.values, owner));
  }
  throw nb::key_error(name.c_str());
}

ColourArray render(const MapBands& bands, const Image<GroundClass>& kind, double cell_m) {
  ImageView<const float> elevation;
  for (const MapBand& band : bands.list) {
    if (band.name == "elevation_m") elevation = band.values;
  }
  return owned_array(render_map(elevation, kind, cell_m, elevation_colour_range(elevation, kind)));
}

namespace {

using Mapper = Guarded<StopMapper>;

void add_view(Mapper& mapper, const RectifiedPairValue& pair, double nearest_m) {
  check(mapper.use([&](StopMapper& stop) { return stop.add(pair.pair, nearest_m); }));
}

LocalMapValue make_map(Mapper& mapper, const Pose& map_from_body) {
  return mapper.use([&](StopMapper& stop) {
    if (stop.views().empty()) {
      throw RaisedError(
          Error{ErrorCode::usage, "there is no view to make a map of", "StopMapper.map", "add one before"});
    }
    const std::vector<SurfacePoint> points = surface_points(stop.merge());
    LocalMap map = stop.map(points, map_from_body);
    stop.leave();
    return LocalMapValue(std::move(map));
  });
}

void save(const LocalMapValue& map, const PathText& path) {
  std::string stem = path;
  if (stem.ends_with(".tif")) stem.resize(stem.size() - 4);
  check(write_local_map(map.map, {}, stem));
}

void bind_obstacles(nb::module_& m) {
  nb::class_<Obstacle>(m, "Obstacle", "Connected cells of a map that are obstacles.")
      .def_prop_ro(
          "middle_m", [](const Obstacle& o) { return matrix_array(o.middle_m); }, "x and y of its middle, m.",
          nb::rv_policy::automatic)
      .def_ro("width_m", &Obstacle::width_m, "Along x.")
      .def_ro("length_m", &Obstacle::length_m, "Along y.")
      .def_ro("height_m", &Obstacle::height_m, "Above the ground.")
      .def_ro("cells", &Obstacle::cells);
}

}  // namespace

void bind_local_maps(nb::module_& m) {
  bind_obstacles(m);
  nb::class_<LocalMapValue> map(
      m, "LocalMap",
      "The terrain around one stop as a grid. Layers are float32 of shape (rows, columns); row 0 lies in "
      "the north (largest y), NaN is unknown.");
  bind_layers(map);
  map.def_prop_ro("map_from_body", [](const LocalMapValue& v) { return v.map.map_from_body; })
      .def_prop_ro("obstacles", [](const LocalMapValue& v) { return v.map.obstacles; })
      .def("save", save, "path"_a, "Writes all layers as GeoTIFF, and a picture beside it (.png).");
  nb::class_<Mapper>(m, "StopMapper", "3D reconstruction of one stop: its views are merged and become a local map.")
      .def(
          "__init__",
          [](Mapper* self, const MappingOptions* options, const DisparityOptions* disparity,
             std::optional<int> threads) {
            new (self) Mapper(
                value_of(StopMapper::create(disparity == nullptr ? DisparityOptions() : *disparity,
                                            options == nullptr ? MappingOptions() : *options, thread_pool(threads))));
          },
          "options"_a.none() = nb::none(), "disparity"_a.none() = nb::none(), nb::kw_only(), "threads"_a = nb::none())
      .def(
          "add", add_view, "pair"_a, "nearest_m"_a = 0.0,
          "Adds a view of the stop, whose disparities are computed. `nearest_m`: nearest depth; 0: disparities up to a "
          "quarter of the width.")
      .def("map", make_map, "map_from_body"_a = Pose(),
           "Merges the views into a map around the body, and begins a new stop. `map_from_body`: with z up.");
}

}  // namespace spartan::python
