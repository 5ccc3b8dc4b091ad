// What a map leaves on the disk: GeoTIFF, pictures, point cloud.
#pragma once

#include <span>
#include <string>

#include "spartan/core/result.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "spartan/slam/global_map.h"

namespace spartan {

/// `path` without ending: .tif (bands of docs/formats.md) and .png (relief with classes). Code `output`.
Status write_local_map(const LocalMap& map, const std::string& path);

/// The same of everything that the global map knows; nothing where it is empty. Codes: GlobalMap::view's, `output`.
Status write_global_map(GlobalMap& map, const MapOptions& options, const ThreadPool& workers, const std::string& path);

/// Removes what one of them wrote to `path`, where it is there. Code `output`.
Status remove_map_files(const std::string& path);

/// A part of the global map as a GeoTIFF of all layers. Code `output`.
Status write_map_geotiff(const MapView& view, const MapOptions& options, const ThreadPool& workers,
                         const std::string& path);

/// All of a position's 3D reconstruction, into an existing folder: map.tif, map.png, obstacles.csv; range.pfm,
/// range_sigma.pfm, panorama.png, coverage.png and points.ply of the merged view; of each view
/// `<pair>_<stamp_ns>_classes.png` and `_v_disparity.png` where ground was found. Code `output`.
Status write_position(std::span<const StopView> views, const MergedRange& merged, const LocalMap& map,
                      const MappingOptions& options, const std::string& folder);

}  // namespace spartan
