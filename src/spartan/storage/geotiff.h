// Reading and writing of raster maps as GeoTIFF, through GDAL.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"

namespace spartan {

/// What a raster map states about itself: the name of its coordinate system and items of the default metadata domain.
struct MapDescription {
  std::string coordinate_system = "world frame of Spartan, metres";
  std::vector<std::pair<std::string, std::string>> items = {};  ///< name and value
};

/// Writes float32 bands of equal size as a cloud-optimized GeoTIFF (tiles of 512 cells, compressed, overviews by
/// nearest neighbour of maps of more than 512 cells a side), with nodata NaN, in a local (engineering) coordinate
/// system in metres. Bands have their names, units, statistics and, in `path`.aux.xml, the names of their categories. A
/// single band with categories is written as bytes with a colour table and nodata 0; NaN is then 0. Each file is
/// written atomically, and the map is read back before it replaces an older one. Code `output` if it cannot be written,
/// `usage` if Spartan was built without GDAL.
Status write_geotiff(const std::string& path, const GeoTransform& place, const std::vector<MapBand>& bands,
                     const MapDescription& description = {});
/// The file beside a GeoTIFF that GDAL reads with it: names of categories.
std::string geotiff_sidecar(const std::string& path);

/// The content of such a GeoTIFF; bands as float32.
struct LoadedMap {
  GeoTransform place;
  std::vector<std::string> names;
  std::vector<Image<float>> bands;
};
/// Code `input` if the file cannot be read, `usage` if Spartan was built without GDAL.
Result<LoadedMap> read_geotiff(const std::string& path);

}  // namespace spartan
