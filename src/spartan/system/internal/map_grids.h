// Layers of a map as ESRI ASCII grids, and maps of map_server and Nav2.
#pragma once

#include <string>

#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/slam/global_map.h"

namespace spartan::internal {

/// ESRI ASCII grid of one layer; NODATA_value -9999.
std::string ascii_grid(const MapBand& band, const GeoTransform& place);

/// Writes `path` (YAML) and an image .pgm beside it, as map_server of ROS and Nav2 read them (mode trinary): obstacles
/// and cavities are occupied (0), free cells 254, others unknown (205). Code `output`.
Status write_occupancy_map(const MapView& view, const std::string& path);

}  // namespace spartan::internal
