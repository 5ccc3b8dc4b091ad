// Files of a map: GeoTIFF, images, point cloud (docs/reference/files.md).
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "spartan/slam/global_map.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// What the files of a map state about it.
struct MapContext {
  std::optional<bool> x_is_east = {};        ///< else x is the start heading; none: not known
  std::map<std::int32_t, Stamp> stops = {};  ///< of the stops that the map was made of, by their ids
};

/// Writes `path`.tif (all layers, docs/reference/files.md) and `path`.png (elevation and classes with axes, scale and
/// legend). Code `output`.
Status write_local_map(const LocalMap& map, const MapContext& about, const std::string& path);

/// Writes the same files of the whole global map; none if it is empty. Codes: those of GlobalMap::view, `output`.
Status write_global_map(GlobalMap& map, const MapOptions& options, std::optional<bool> x_is_east,
                        const ThreadPool& workers, const std::string& path);

/// Removes the files that write_local_map() or write_global_map() wrote to `path`, if they exist. Code `output`.
Status remove_map_files(const std::string& path);

/// figure: elevation and classes with axes, scale and legend. ply, pcd: centres of cells. octomap: a binary OcTree.
/// gltf: a mesh of the surface (glTF 2.0, binary). ascii_grid: one layer as an ESRI ASCII grid. occupancy_grid: the
/// YAML file of map_server (ROS) and Nav2, with an image .pgm beside it.
enum class MapFormat { geotiff, figure, ply, pcd, octomap, gltf, ascii_grid, occupancy_grid };

/// By the extension: .tif, .png, .ply, .pcd, .bt, .glb, .asc or .yaml. Code `usage` for others.
Result<MapFormat> map_format_of(const std::string& path);

/// What export_map() writes.
struct MapExport {
  MapFormat format = MapFormat::geotiff;
  std::vector<std::string> layers = {};  ///< names of the bands of a GeoTIFF or grid; empty: all, or elevation_m
  MapOptions options = {};               ///< of the slopes and costs
  MapContext about = {};
  Image<Rgb8> colours = {};  ///< of the cells of a mesh; empty: by elevation and class
};

/// The stops of a global map as MapContext has them.
std::map<std::int32_t, Stamp> stamps_of(const GlobalMap& map);

/// Writes a part of the global map. Codes: `usage` (unknown layers), `output`.
Status export_map(const MapView& view, const MapExport& request, const ThreadPool& workers, const std::string& path);

/// Writes the 3D reconstruction of a stop into an existing folder: map.tif, map.png, obstacles.csv; range.pfm,
/// range_sigma.pfm, panorama.png, coverage.png and points.ply of the merged view; `<pair>_<stamp_ns>_classes.png` and
/// `<pair>_<stamp_ns>_v_disparity.png` of each view in which ground was found. Code `output`.
Status write_stop_files(std::span<const StopView> views, const MergedRange& merged, const LocalMap& map,
                        const MappingOptions& options, const std::string& folder);

/// Read-only access to a saved global map.
class SavedMap {
 public:
  /// `path`: a map file or a run folder. Codes: `input` (missing, damaged, or without a map), `configuration` (of
  /// another version).
  static Result<SavedMap> open(const std::string& path);

  GlobalMap& map() { return file_ ? file_->map() : *run_map_; }
  /// Options of the run; the defaults for a map file.
  const RunOptions& options() const { return options_; }
  /// The stops of the map, and where its x axis points if the run has stated it.
  MapContext about() const;
  /// Colours of the cells of a view by the images of the run: the mean of the terrain points in each cell, of at most
  /// 200 views spread over the run; cells without a point are light gray. Without any point (a map file, or a run
  /// without terrain views or their files) by elevation and class, as in render_map(). Code `store_damaged`.
  Result<Image<Rgb8>> cell_colours(const MapView& view) const;
  /// To export `view` of it, with the options of the run. Code: cell_colours().
  Result<MapExport> request(const MapView& view, MapFormat format, std::vector<std::string> layers = {}) const;

 private:
  explicit SavedMap(RunOptions options) : options_(std::move(options)) {}
  static Result<SavedMap> open_run(const std::string& path);

  RunOptions options_;
  std::string terrain_folder_;  // of a run
  std::optional<bool> x_is_east_;
  std::unique_ptr<MapFile> file_;
  std::unique_ptr<RunStore> run_store_;
  std::unique_ptr<GlobalMap> run_map_;
};

}  // namespace spartan
