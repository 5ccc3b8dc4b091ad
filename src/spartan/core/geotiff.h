// Maps for geographic programs: GeoTIFF.
#pragma once

#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"

namespace spartan {

/// One band of a map. Row 0 lies in the north (largest y); NaN is "no data".
struct MapBand {
  std::string name;
  ImageView<const float> values;
};

/// Where a map lies in the world plane, metres: its north-west corner and the side of a cell.
struct MapPlace {
  double west_m = 0, north_m = 0, cell_m = 1;
};

/// Writes float32 bands of one size, compressed, without a map projection; the file appears whole or not at all.
/// Code `output` where it cannot be written, `usage` where Spartan was built without GDAL.
Status write_geotiff(const std::string& path, const MapPlace& place, const std::vector<MapBand>& bands);

/// What a GeoTIFF of one such map holds; bands as float32. Code `input` where it cannot be read.
struct LoadedMap {
  MapPlace place;
  std::vector<std::string> names;
  std::vector<Image<float>> bands;
};
Result<LoadedMap> read_geotiff(const std::string& path);

}  // namespace spartan
