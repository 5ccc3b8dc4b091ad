#include "program/report_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "program/html_parts.h"
#include "spartan/core/image_io.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"
#include "spartan/system/saved_map.h"

namespace spartan::program {
namespace {

constexpr int kMostMaps = 6, kGlobalWidth_px = 1100;
constexpr double kMostDecades = 4;  // of points in a cell

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

// How often each cell of the global map was seen.
Result<std::string> coverage_of(const std::string& run) {
  auto saved = SavedMap::open(run);
  if (!saved) return failure(saved);
  const auto view = saved->map().view(saved->map().extent());
  if (!view) return failure(view);
  constexpr int kScale = 4;
  Image<Rgb8> picture(view->count.width() * kScale, view->count.height() * kScale);
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      const float count = view->count(x / kScale, y / kScale);
      picture(x, y) = count > 0 ? cold_to_hot(std::min(1.0, std::log10(static_cast<double>(count)) / kMostDecades))
                                : Rgb8{30, 30, 34};
    }
  }
  const int width = std::min(kGlobalWidth_px, picture.width());
  return html_picture(shrunk(picture.view(), width),
                      fmt::format("Its coverage: points in each cell, from one (blue) to {} (red)",
                                  static_cast<int>(std::pow(10, kMostDecades))),
                      width);
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
  const auto global = picture_of(
      folder.global_map() + ".png",
      "The global map of all positions: relief, obstacles (red), cavities (blue), unknown (dark)", kGlobalWidth_px);
  if (!global) return failure(global);
  const auto coverage = coverage_of(run);
  if (!coverage) return failure(coverage);
  return html + *global + *coverage;
}

}  // namespace spartan::program
