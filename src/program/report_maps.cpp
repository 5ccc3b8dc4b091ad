#include "program/report_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <vector>

#include "program/html_parts.h"
#include "spartan/core/image_io.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan::program {
namespace {

constexpr int kMostMaps = 6;

// MatchVerdict's names, for people.
std::string in_words(std::string verdict) {
  std::replace(verdict.begin(), verdict.end(), '_', ' ');
  return verdict;
}

Result<std::string> picture_of(const std::string& path, const std::string& caption, int width_px) {
  const auto image = read_image(path);
  if (!image) return failure(image);
  const int width = std::min(width_px, image->width());
  return html_picture(shrunk(image->as<Rgb8>(), width), caption, width);
}

}  // namespace

Result<std::string> map_pictures(const std::string& run) {
  const RunFolder folder{run};
  auto store = RunStore::open_read_only(folder.store());
  if (!store) return failure(store);
  const auto maps = store->maps();
  if (!maps) return failure(maps);
  std::string html;
  const auto count = std::min<std::size_t>(kMostMaps, maps->size());
  for (std::size_t i = 0; i < count; ++i) {
    const MapRecord& map = (*maps)[count > 1 ? i * (maps->size() - 1) / (count - 1) : 0];
    const std::string overlap = map.overlap > 0 ? fmt::format(" ({:.0f} % overlap)", 100 * map.overlap) : "";
    const auto picture = picture_of(
        folder.local_map(map.stamp) + ".png",
        fmt::format("Position {}: {} views, {} cells known, {} obstacles (red), north up. In the global map: {}{}",
                    map.position_id, map.views, map.known_cells, map.obstacles, in_words(map.verdict), overlap),
        360);
    if (!picture) return failure(picture);
    html += *picture;
  }
  if (!std::filesystem::exists(folder.global_map() + ".png")) return html;
  const auto global =
      picture_of(folder.global_map() + ".png",
                 "The global map of all positions: relief, obstacles (red), cavities (blue), unknown (dark)", 1100);
  if (!global) return failure(global);
  return html + *global;
}

}  // namespace spartan::program
