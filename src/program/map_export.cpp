// spartan map export: a global map in the formats of other programs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

#include "program/map.h"
#include "spartan/image_io/image_io.h"
#include "spartan/reconstruction/point_cloud.h"
#include "spartan/reconstruction/rendering.h"
#include "spartan/system/map_files.h"

namespace spartan::program {
namespace {

constexpr double kFarthestCell = 5e8;  // cells are counted in int

struct MapExportArguments {
  std::string map, output;
  std::vector<double> window_m;  // west, south, east, north
};

Result<LatticeWindow> window_of(const MapExportArguments& a, const GlobalMap& map) {
  if (a.window_m.empty()) return map.extent();
  const double west = a.window_m[0], south = a.window_m[1], east = a.window_m[2], north = a.window_m[3];
  if (!(east > west) || !(north > south)) {
    return failure(ErrorCode::usage, "is empty: east must exceed west, and north south", "--window",
                   "give west,south,east,north in metres");
  }
  const double farthest_m = kFarthestCell * map.cell_m();
  if (std::max({std::abs(west), std::abs(south), std::abs(east), std::abs(north)}) > farthest_m) {
    return failure(ErrorCode::usage, fmt::format("exceeds {:.0f} m from the origin", farthest_m), "--window",
                   "give west,south,east,north in metres");
  }
  return window_between(west, south, east, north, map.cell_m());
}

// The centres of the cells, in the colours of the image.
PointCloud cloud_of(const MapView& view) {
  const Image<Rgb8> colours =
      render_map(view.elevation_m, view.kind, view.cell_m, elevation_colour_range(view.elevation_m, view.kind));
  PointCloud cloud;
  for (int r = 0; r < view.window.height; ++r) {
    for (int c = 0; c < view.window.width; ++c) {
      if (!(view.count(c, r) > 0)) continue;
      const Eigen::Vector2f at = cell_centre(view.place(), c, r).cast<float>();
      cloud.push_back({{at.x(), at.y(), view.elevation_m(c, r)}, colours(c, r)});
    }
  }
  return cloud;
}

Status write_map(SavedMap& saved, const MapExportArguments& a, const ThreadPool& workers) {
  const std::string ending = std::filesystem::path(a.output).extension().string();
  if (ending == ".map") {
    if (!a.window_m.empty()) return failure(ErrorCode::usage, "a .map file always holds the whole map", "--window");
    return MapFile::save(saved.map(), a.output);
  }
  const auto window = window_of(a, saved.map());
  if (!window) return failure(window);
  const auto view = saved.map().view(*window);
  if (!view) return failure(view);
  if (ending == ".tif") return write_map_geotiff(*view, saved.options().mapping.map, workers, a.output);
  if (ending == ".png") return write_png(a.output, draw_map(*view, "Map"));
  if (ending == ".ply") return write_ply(a.output, cloud_of(*view));
  return failure(ErrorCode::usage, "has an unknown extension", a.output, "known extensions: .tif, .png, .ply, .map");
}

Result<ExitCode> export_map(const Context& context, const MapExportArguments& a) {
  auto saved = SavedMap::open(a.map);
  if (!saved) return failure(saved);
  if (Status s = write_map(*saved, a, ThreadPool(context.threads)); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_map_export(CLI::App& map, Context& context) {
  auto a = std::make_shared<MapExportArguments>();
  CLI::App* command =
      add_command(map, context, "export", "Export a global map as GeoTIFF, image, point cloud or map file",
                  "map export my_run -o site.tif", [&context, a] { return export_map(context, *a); });
  command->add_option("map", a->map, "Saved map (.map) or run folder.")->required();
  command
      ->add_option("-o,--output", a->output,
                   "File to write; its extension selects the format: .tif (all layers), .png (an image), .ply (cell "
                   "centres), .map.")
      ->required();
  command
      ->add_option(
          "--window", a->window_m,
          "Export only this part: the smallest x, smallest y, largest x and largest y in metres of the world frame.")
      ->delimiter(',')
      ->expected(4);
  add_threads_option(*command, context);
}

}  // namespace spartan::program
