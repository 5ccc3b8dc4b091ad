#include "spartan/system/internal/map_grids.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <iterator>

#include "spartan/core/files.h"
#include "spartan/core/strict_yaml.h"

namespace spartan::internal {

std::string ascii_grid(const MapBand& band, const GeoTransform& place) {
  const ImageView<const float>& values = band.values;
  std::string text =
      fmt::format("ncols {}\nnrows {}\nxllcorner {}\nyllcorner {}\ncellsize {}\nNODATA_value -9999\n", values.width(),
                  values.height(), place.west_m, place.north_m - values.height() * place.cell_m, place.cell_m);
  for (int y = 0; y < values.height(); ++y) {
    for (int x = 0; x < values.width(); ++x) {
      const float value = values(x, y);
      fmt::format_to(std::back_inserter(text), "{}{}", x == 0 ? "" : " ", std::isfinite(value) ? value : -9999.0F);
    }
    text += '\n';
  }
  return text;
}

Status write_occupancy_map(const MapView& view, const std::string& path) {
  constexpr char kOccupied = 0, kFree = static_cast<char>(254), kUnknown = static_cast<char>(205);
  std::string image = fmt::format("P5\n{} {}\n255\n", view.window.width, view.window.height);
  for (int r = 0; r < view.window.height; ++r) {
    for (int c = 0; c < view.window.width; ++c) {
      const GroundClass kind = view.kind(c, r);
      image += kind == GroundClass::unknown ? kUnknown : kind == GroundClass::ground ? kFree : kOccupied;
    }
  }
  const std::filesystem::path image_path = std::filesystem::path(path).replace_extension(".pgm");
  const GeoTransform place = view.place();
  // A value of 205 is (255 - 205) / 255 = 0.1961: unknown only if free_thresh is below it.
  const std::string yaml = fmt::format(
      "image: {}\nmode: trinary\nresolution: {}\norigin: [{}, {}, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
      "free_thresh: 0.196\n",
      yaml_quoted(image_path.filename().string()), view.cell_m, place.west_m,
      place.north_m - view.window.height * view.cell_m);
  return write_files_atomically({{image_path.string(), image}, {path, yaml}});
}

}  // namespace spartan::internal
