// Writing of a part of the global map in the formats of other programs.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <utility>

#include "spartan/core/files.h"
#include "spartan/figures/map_plot.h"
#include "spartan/image_io/image_io.h"
#include "spartan/reconstruction/point_cloud.h"
#include "spartan/reconstruction/rendering.h"
#include "spartan/system/internal/cell_colours.h"
#include "spartan/system/internal/map_description.h"
#include "spartan/system/internal/map_grids.h"
#include "spartan/system/internal/map_mesh.h"
#include "spartan/system/internal/octomap_file.h"
#include "spartan/system/map_files.h"

namespace spartan {

using namespace internal;

namespace {

// The centres of the cells, in the colours of the image, with the time of the stop that observed them first.
PointCloud cloud_of(const MapView& view, const std::map<std::int32_t, Stamp>& stops) {
  const Image<Rgb8> colours =
      render_map(view.elevation_m, view.kind, view.cell_m, elevation_colour_range(view.elevation_m, view.kind));
  PointCloud cloud;
  for (int r = 0; r < view.window.height; ++r) {
    for (int c = 0; c < view.window.width; ++c) {
      if (!(view.count(c, r) > 0)) continue;
      const Eigen::Vector2f at = cell_centre(view.place(), c, r).cast<float>();
      const auto stop = stops.find(view.stop(c, r));
      cloud.push_back({{at.x(), at.y(), view.elevation_m(c, r)},
                       colours(c, r),
                       std::sqrt(view.variance_m2(c, r)),
                       stop == stops.end() ? 0 : stop->second.seconds()});
    }
  }
  return cloud;
}

// The named bands in their own order; all if `names` is empty.
Result<std::vector<MapBand>> select(const std::vector<MapBand>& all, const std::vector<std::string>& names) {
  std::vector<std::string> known;
  known.reserve(all.size());
  for (const MapBand& band : all) known.push_back(band.name);
  for (const std::string& name : names) {
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      return failure(ErrorCode::usage, fmt::format("there is no layer '{}'", name), "--layer",
                     fmt::format("layers: {}", fmt::join(known, ", ")));
    }
  }
  if (names.empty()) return all;
  std::vector<MapBand> selected;
  for (const MapBand& band : all) {
    if (std::find(names.begin(), names.end(), band.name) != names.end()) selected.push_back(band);
  }
  return selected;
}

Status write_layers(const MapView& view, const MapExport& request, const ThreadPool& workers, const std::string& path) {
  const bool as_ascii = request.format == MapFormat::ascii_grid;
  const Traversability shape = view.shape(request.options, workers);
  const MapBands all = view.bands(shape);
  const bool elevation_alone = as_ascii && request.layers.empty();
  const auto bands = select(all.list, elevation_alone ? std::vector<std::string>{"elevation_m"} : request.layers);
  if (!bands) return failure(bands);
  if (!as_ascii) return write_geotiff(path, view.place(), *bands, map_description(request.about));
  if (bands->size() != 1) return failure(ErrorCode::usage, "an ASCII grid holds one layer", "--layer", "name one");
  return write_file_atomically(path, ascii_grid(bands->front(), view.place()));
}

Status write_mesh(const MapView& view, const MapExport& request, const std::string& path) {
  const bool by_images = request.colours.width() == view.window.width && request.colours.height() == view.window.height;
  const Image<Rgb8> by_elevation = by_images ? Image<Rgb8>() : CellColours(view).image(view);
  const TerrainMesh mesh = mesh_of(view, by_images ? request.colours : by_elevation);
  if (mesh.triangles.empty())
    return failure(ErrorCode::input, "has no surface: no three neighbouring cells are known", path);
  return write_file_atomically(path, glb_file(mesh));
}

}  // namespace

std::map<std::int32_t, Stamp> stamps_of(const GlobalMap& map) {
  std::map<std::int32_t, Stamp> stamps;
  for (const MapStop& stop : map.stops()) stamps[stop.id] = stop.stamp;
  return stamps;
}

Result<MapFormat> map_format_of(const std::string& path) {
  constexpr std::array<std::pair<std::string_view, MapFormat>, 8> kExtensions{{{".tif", MapFormat::geotiff},
                                                                               {".png", MapFormat::figure},
                                                                               {".ply", MapFormat::ply},
                                                                               {".pcd", MapFormat::pcd},
                                                                               {".bt", MapFormat::octomap},
                                                                               {".glb", MapFormat::gltf},
                                                                               {".asc", MapFormat::ascii_grid},
                                                                               {".yaml", MapFormat::occupancy_grid}}};
  const std::string extension = std::filesystem::path(path).extension().string();
  for (const auto& [name, format] : kExtensions) {
    if (extension == name) return format;
  }
  return failure(ErrorCode::usage, "has an unknown extension", path,
                 "known extensions: .tif, .png, .ply, .pcd, .bt, .glb, .asc, .yaml, .map");
}

Status export_map(const MapView& view, const MapExport& request, const ThreadPool& workers, const std::string& path) {
  const bool layered = request.format == MapFormat::geotiff || request.format == MapFormat::ascii_grid;
  if (!request.layers.empty() && !layered)
    return failure(ErrorCode::usage, "only .tif and .asc files have layers", "--layer", "leave it out");
  switch (request.format) {
    case MapFormat::geotiff:
    case MapFormat::ascii_grid:
      return write_layers(view, request, workers, path);
    case MapFormat::figure:
      return write_png(path, to_image(map_plot(view.elevation_m, view.kind, view.place(), "Global map")));
    case MapFormat::ply:
      return write_ply(path, cloud_of(view, request.about.stops));
    case MapFormat::pcd:
      return write_pcd(path, cloud_of(view, request.about.stops));
    case MapFormat::octomap: {
      const auto octree = octomap_file(view);
      return octree ? write_file_atomically(path, *octree) : Status(failure(octree));
    }
    case MapFormat::gltf:
      return write_mesh(view, request, path);
    case MapFormat::occupancy_grid:
      return write_occupancy_map(view, path);
  }
  return failure(ErrorCode::internal, "is not a format of maps", path);
}

}  // namespace spartan
