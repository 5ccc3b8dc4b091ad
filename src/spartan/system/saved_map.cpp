#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "spartan/core/files.h"
#include "spartan/system/internal/terrain_files.h"
#include "spartan/system/map_files.h"
#include "spartan/system/run_folder.h"

namespace spartan {
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

Result<PointCloud> SavedMap::points() const {
  if (!run_store_) return PointCloud();
  const auto terrain = run_store_->terrain();
  if (!terrain) return failure(terrain);
  return terrain->empty() ? PointCloud() : internal::terrain_cloud(terrain_folder_, *terrain);
}

Result<MapExport> SavedMap::request(MapFormat format, std::vector<std::string> layers) const {
  auto coloured = format == MapFormat::gltf ? points() : Result<PointCloud>();
  if (!coloured) return failure(coloured);
  return MapExport{format, std::move(layers), options_.mapping.map, about(), std::move(*coloured)};
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
