#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "spartan/core/files.h"
#include "spartan/system/internal/cell_colours.h"
#include "spartan/system/internal/terrain_files.h"
#include "spartan/system/map_files.h"
#include "spartan/system/run_folder.h"

namespace spartan {

using namespace internal;

namespace {

// As the summary states it; none before a run has written one.
std::optional<bool> x_is_east(const RunFolder& folder) {
  const auto text = read_file(folder.summary());
  if (!text) return std::nullopt;
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_object() || !json.contains("world") || !json["world"].is_object()) return std::nullopt;
  const auto heading = json["world"].find("heading");
  if (heading == json["world"].end() || (*heading != "east" && *heading != "start")) return std::nullopt;
  return *heading == "east";
}

}  // namespace

MapContext SavedMap::about() const {
  return {x_is_east_, stamps_of(file_ ? file_->map() : *run_map_)};
}

Result<Image<Rgb8>> SavedMap::cell_colours(const MapView& view) const {
  constexpr std::size_t kMostClouds = 200;
  CellColours colours(view);
  if (!run_store_) return colours.image(view);
  const auto terrain = run_store_->terrain();
  if (!terrain) return failure(terrain);
  const std::size_t step = (terrain->size() + kMostClouds - 1) / kMostClouds;
  for (std::size_t i = 0; i < terrain->size(); i += step) {
    // Clouds that were removed, or that a full disk did not take, are left out.
    if (const auto cloud = terrain_cloud(terrain_folder_, {(*terrain)[i]})) colours.add(*cloud);
  }
  return colours.image(view);
}

Result<MapExport> SavedMap::request(const MapView& view, MapFormat format, std::vector<std::string> layers) const {
  MapExport request{format, std::move(layers), options_.mapping.map, about(), {}};
  if (format != MapFormat::gltf) return request;
  auto colours = cell_colours(view);
  if (!colours) return failure(colours);
  request.colours = std::move(*colours);
  return request;
}

Result<SavedMap> SavedMap::open_run(const std::string& path) {
  const RunFolder folder{path};
  auto store = RunStore::open_read_only(folder.store());
  if (!store) return failure(store);
  auto options = load_options<RunOptions>(folder.config());
  if (!options) return failure(options);
  const auto rig = read_rig_yaml(folder.rig());
  if (!rig) return failure(rig);
  SavedMap saved(resolved_options(std::move(*options), *rig));
  saved.terrain_folder_ = folder.terrain();
  saved.x_is_east_ = x_is_east(folder);
  saved.run_store_ = std::make_unique<RunStore>(std::move(*store));
  auto map =
      GlobalMap::from_store(saved.options_.slam.map, saved.options_.mapping.map.cell_m, saved.run_store_->tiles());
  if (!map) return failure(map);
  saved.run_map_ = std::make_unique<GlobalMap>(std::move(*map));
  return saved;
}

Result<SavedMap> SavedMap::open(const std::string& path) {
  std::error_code error;
  const bool is_run = std::filesystem::is_directory(path, error);
  auto saved = is_run ? open_run(path) : Result<SavedMap>(SavedMap(RunOptions()));
  if (!saved) return failure(saved);
  if (!is_run) {
    auto file = MapFile::open(path, saved->options_.slam.map, Database::Mode::read_only);
    if (!file) return failure(file);
    saved->file_ = std::make_unique<MapFile>(std::move(*file));
  }
  if (saved->map().empty()) {
    return failure(ErrorCode::input, "contains no map", path,
                   "a run makes maps at stops that have frames of a stereo pair other than the odometry pair");
  }
  return saved;
}

}  // namespace spartan
