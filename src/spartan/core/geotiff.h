// Reading and writing of raster maps as GeoTIFF, through GDAL.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"

namespace spartan {

/// One band of a raster map. Row 0 is the northernmost (largest y); NaN means "no data".
struct MapBand {
  std::string name;
  ImageView<const float> values;
};

/// Georeference of a north-up raster in the world plane, metres: x and y of its north-west corner and the side of a
/// cell (GDAL's geotransform without rotation).
struct GeoTransform {
  double west_m = 0, north_m = 0, cell_m = 1;
};

/// Writes float32 bands of equal size, compressed, without a map projection. The file is written atomically.
/// Code `output` if it cannot be written, `usage` if Spartan was built without GDAL.
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
