// spartan map export: a global map in the formats of other programs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <vector>

#include "program/map.h"
#include "spartan/system/map_files.h"

namespace spartan::program {
namespace {

constexpr double kFarthestCell = 5e8;  // cells are counted in int

constexpr const char* kWindowHint = "give the smallest x, smallest y, largest x and largest y in metres";

struct MapExportArguments {
  std::string map, output;
  std::vector<std::string> layers;
  std::vector<double> window_m;  // west, south, east, north
};

Result<LatticeWindow> window_of(const MapExportArguments& a, const GlobalMap& map) {
  if (a.window_m.empty()) return map.extent();
  const double west = a.window_m[0], south = a.window_m[1], east = a.window_m[2], north = a.window_m[3];
  if (!(east > west) || !(north > south)) {
    return failure(ErrorCode::usage, "is empty: the third number must exceed the first, and the fourth the second",
                   "--window", kWindowHint);
  }
  const double farthest_m = kFarthestCell * map.cell_m();
  if (std::max({std::abs(west), std::abs(south), std::abs(east), std::abs(north)}) > farthest_m) {
    return failure(ErrorCode::usage, fmt::format("exceeds {:.0f} m from the origin", farthest_m), "--window",
                   kWindowHint);
  }
  return window_between(west, south, east, north, map.cell_m());
}

// The second file that some formats have; empty for the others.
std::string file_beside(const std::string& output) {
  std::filesystem::path path = output;
  if (path.extension() == ".yaml") return path.replace_extension(".pgm").string();
  return path.extension() == ".tif" ? output + ".aux.xml" : std::string();
}

bool knows_a_cell(const MapView& view) {
  for (int r = 0; r < view.window.height; ++r) {
    if (std::any_of(view.count.row(r), view.count.row(r) + view.window.width, [](float n) { return n > 0; }))
      return true;
  }
  return false;
}

Status write_map(SavedMap& saved, const MapExportArguments& a, const Context& context) {
  if (std::filesystem::path(a.output).extension() == ".map") {
    if (!a.window_m.empty()) return failure(ErrorCode::usage, "a .map file always holds the whole map", "--window");
    if (!a.layers.empty()) return failure(ErrorCode::usage, "a .map file always holds all layers", "--layer");
    return MapFile::save(saved.map(), a.output);
  }
  const auto format = map_format_of(a.output);
  if (!format) return failure(format);
  const auto window = window_of(a, saved.map());
  if (!window) return failure(window);
  const auto view = saved.map().view(*window);
  if (!view) return failure(view);
  if (!knows_a_cell(*view)) context.log.warning("--window: no cell of it is known");
  const auto request = saved.request(*view, *format, a.layers);
  return request ? export_map(*view, *request, ThreadPool(context.threads), a.output) : Status(failure(request));
}

Result<ExitCode> export_command(const Context& context, const MapExportArguments& a) {
  if (Status s = expect_new_file(context, a.output); !s) return failure(s);
  if (const std::string beside = file_beside(a.output); !beside.empty()) {
    if (Status s = expect_new_file(context, beside); !s) return failure(s);
  }
  auto saved = SavedMap::open(a.map);
  if (!saved) return failure(saved);
  if (Status s = write_map(*saved, a, context); !s) return failure(s);
  return kDone;
}

}  // namespace

void add_map_export(CLI::App& map, Context& context) {
  auto a = std::make_shared<MapExportArguments>();
  CLI::App* command =
      add_command(map, context, "export", "Export a global map for GIS, ROS, point cloud viewers, or as an image",
                  "map export my_run -o my_map.tif", [&context, a] { return export_command(context, *a); });
  command->add_option("map", a->map, "Saved map (.map) or run folder.")->required();
  command
      ->add_option(
          "-o,--output", a->output,
          "File to write; its extension selects the format: .tif (GeoTIFF), .png (figure), .ply or .pcd "
          "(points, one a cell), .bt (OctoMap), .glb (glTF mesh in the colours of the images), .asc (ESRI ASCII grid), "
          ".yaml (occupancy grid of ROS and Nav2, with a .pgm beside it), .map.")
      ->required();
  command
      ->add_option(
          "--layer", a->layers,
          "Layer to write, for .tif and .asc (one): elevation_m, elevation_min_m, elevation_max_m, variance_m2, "
          "count, slope_rad, roughness_m, step_m, class, occupancy_logodds or cost. class as the only one is a "
          "GeoTIFF of bytes with a colour table. Repeatable (default: all for .tif, elevation_m for .asc).")
      ->allow_extra_args(false)
      ->option_text("NAME");
  command
      ->add_option(
          "--window", a->window_m,
          "Export only this part: the smallest x, smallest y, largest x and largest y in metres of the world frame "
          "(default: the whole map). It is enlarged to whole cells.")
      ->delimiter(',')
      ->expected(4)
      ->allow_extra_args(false)
      ->option_text("X,Y,X,Y");
  add_force_flag(*command, context);
  add_threads_option(*command, context);
}

}  // namespace spartan::program
