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

/// Arrays over the bands by their names; `owner` keeps them.
nb::dict layers_of(const MapBands& bands, const nb::handle& owner);
/// Raises KeyError.
nb::object layer_of(const MapBands& bands, const std::string& name, const nb::handle& owner);
/// The map in colours.
ColourArray render(const MapBands& bands, ImageView<const GroundClass> kind, double cell_m);

/// A map with its bands, which borrow from it.
struct LocalMapValue {
  explicit LocalMapValue(LocalMap made) : map(std::move(made)), bands(map.bands()) {}

  LocalMap map;
  MapBands bands;
};

/// A part of the global map with its bands, which borrow from it.
struct MapViewValue {
  MapViewValue(MapView seen, Traversability traversability)
      : view(std::move(seen)), shape(std::move(traversability)), bands(view.bands(shape)) {}

  MapView view;
  Traversability shape;
  MapBands bands;
};

}  // namespace spartan::python
