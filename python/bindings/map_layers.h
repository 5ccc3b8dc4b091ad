// Layers of maps as arrays.
#pragma once

#include <nanobind/nanobind.h>

#include <string>
#include <tuple>
#include <utility>

#include "bindings/arrays.h"
#include "spartan/reconstruction/local_map.h"
#include "spartan/slam/global_map.h"

namespace spartan::python {

/// west, east, south, north in m
using Extent = std::tuple<double, double, double, double>;
Extent extent_of(const GeoTransform& place, ImageSize size);

/// A map with its bands, which borrow from it.
struct LocalMapValue {
  explicit LocalMapValue(LocalMap made) : map(std::move(made)), bands(map.bands()) {}
  const Image<GroundClass>& kind() const { return map.kind; }
  GeoTransform place() const { return map.place; }

  LocalMap map;
  MapBands bands;
};

/// A part of the global map with its bands, which borrow from it.
struct MapViewValue {
  MapViewValue(MapView seen, Traversability traversability)
      : view(std::move(seen)), shape(std::move(traversability)), bands(view.bands(shape)) {}
  const Image<GroundClass>& kind() const { return view.kind; }
  GeoTransform place() const { return view.place(); }

  MapView view;
  Traversability shape;
  MapBands bands;
};

/// Arrays over the bands by their names; `owner` keeps them.
nb::dict layers_of(const MapBands& bands, const nb::handle& owner);
/// Raises KeyError.
nb::object layer_of(const MapBands& bands, const std::string& name, const nb::handle& owner);
/// The map in colours.
ColourArray render(const MapBands& bands, const Image<GroundClass>& kind, double cell_m);

/// What local maps and views of the global map have in common.
template <class Map>
void bind_layers(nb::class_<Map>& bound) {
  bound
      .def_prop_ro(
          "layers", [](const nb::handle& self) { return layers_of(nb::inst_ptr<Map>(self)->bands, self); },
          nb::sig("def layers(self) -> dict[str, numpy.typing.NDArray[numpy.float32]]"),
          "All layers by their names in map files: `elevation_m`, `variance_m2`, `class`, `cost` …")
      .def(
          "__getitem__",
          [](const nb::handle& self, const std::string& name) {
            return layer_of(nb::inst_ptr<Map>(self)->bands, name, self);
          },
          nb::sig("def __getitem__(self, layer: str, /) -> numpy.typing.NDArray[numpy.float32]"),
          "One layer; KeyError.")
      .def_prop_ro(
          "cell_m", [](const Map& m) { return m.place().cell_m; }, "Side of a cell, m.")
      .def_prop_ro(
          "extent", [](const Map& m) { return extent_of(m.place(), m.kind().size()); },
          "(west, east, south, north) in m, as `extent` of matplotlib's imshow.")
      .def(
          "render", [](const Map& m) { return render(m.bands, m.kind(), m.place().cell_m); },
          "Elevations in colours with obstacles in red and cavities in blue, uint8, shape (rows, columns, 3).");
}

}  // namespace spartan::python
