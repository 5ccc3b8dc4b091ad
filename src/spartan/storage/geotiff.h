// Reading and writing of raster maps as GeoTIFF, through GDAL.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"

namespace spartan {

/// Writes float32 bands of equal size, compressed, without a map projection. The file is written atomically.
/// It is read back before it replaces an older one. Code `output` if it cannot be written, `usage` if Spartan was built
/// without GDAL.
Status write_geotiff(const std::string& path, const GeoTransform& place, const std::vector<MapBand>& bands);

/// The content of such a GeoTIFF; bands as float32.
struct LoadedMap {
  GeoTransform place;
  std::vector<std::string> names;
  std::vector<Image<float>> bands;
};
/// Code `input` if the file cannot be read, `usage` if Spartan was built without GDAL.
Result<LoadedMap> read_geotiff(const std::string& path);

}  // namespace spartan
