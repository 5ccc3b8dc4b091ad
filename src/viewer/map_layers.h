// The global map as a few arrays, for drawing in a browser.
#pragma once

#include <string>

#include "spartan/core/result.h"
#include "spartan/system/map_files.h"

namespace spartan::viewer {

/// As RunView::map(). Layers: `elevation_m`, `sigma_m`, `cost` (float32, NaN unknown), `class` (bytes, as in map files)
/// and `colour` (three bytes a cell, of the images), in rows from the north. Maps of more than 400 000 cells are thinned
/// to every second, third … row and column.
Result<std::string> map_layers(SavedMap& saved);

}  // namespace spartan::viewer
