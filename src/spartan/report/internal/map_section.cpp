#include "spartan/report/internal/map_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "spartan/image_io/image_io.h"
#include "spartan/report/internal/html_parts.h"
#include "spartan/system/map_files.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {
namespace {

constexpr int kMostMaps = 6, kGlobalWidth_px = 1100;
constexpr double kMostDecades = 4;  // of points in a cell

// The names of MatchStatus with spaces.
std::string status_text(std::string status) {
  if (status == "decided") return "accepted";
  std::replace(status.begin(), status.end(), '_', ' ');
  return status;
}

Result<std::string> image_of(const std::string& path, const std::string& caption, int width_px) {
  const auto image = read_image(path);
  if (!image) return failure(image);
  const int width = std::min(width_px, image->width());
  return html_image(shrunk(image->as<Rgb8>(), width), caption, width);
}

// Number of points in each cell of the global map.
Result<std::string> coverage_of(GlobalMap& map) {
  const auto view = map.view(map.extent());
  if (!view) return failure(view);
  constexpr int kScale = 4;
  Image<Rgb8> image(view->count.width() * kScale, view->count.height() * kScale);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const float count = view->count(x / kScale, y / kScale);
      image(x, y) = count > 0 ? cold_to_hot(std::min(1.0, std::log10(static_cast<double>(count)) / kMostDecades))
                              : Rgb8{30, 30, 34};
    }
  }
  const int width = std::min(kGlobalWidth_px, image.width());
  return html_image(shrunk(image.view(), width),
                    fmt::format("Points per cell of the global map, from one (blue) to {} (red)",
                                static_cast<int>(std::pow(10, kMostDecades))),
                    width);
}

Result<std::string> global_map_images(const std::string& run) {
  auto saved = SavedMap::open(run);
  if (!saved) return failure(saved);
  GlobalMap& map = saved->map();
  if (const LatticeWindow extent = map.extent(); extent.cells() > GlobalMap::kMostCells) {
    return fmt::format(
        "<p>The global map, {:.0f} m × {:.0f} m, is too large for one image: <code>spartan map export "
        "--window</code> "
        "shows a part of it.</p>\n",
        extent.width * map.cell_m(), extent.height * map.cell_m());
  }
  const auto image = image_of(
      RunFolder{run}.global_map() + ".png",
      "Global map of all stops: shaded elevation, obstacles (red), cavities (blue), unknown (dark)", kGlobalWidth_px);
  if (!image) return failure(image);
  const auto coverage = coverage_of(map);
  if (!coverage) return failure(coverage);
  return *image + *coverage;
}

}  // namespace

Result<std::string> map_images(const std::string& run) {
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
    const auto image =
        image_of(folder.local_map(map.stamp) + ".png",
                 fmt::format("{}, {} observed cells, {} obstacles (red), north up. Match with the global map: {}{}",
                             map.position_id >= 0 ? fmt::format("Stop {}: {} views", map.position_id, map.views)
                                                  : fmt::format("Keyframe at {} s", to_decimal_seconds(map.stamp)),
                             map.known_cells, map.obstacles, status_text(map.status), overlap),
                 360);
    if (!image) return failure(image);
    html += *image;
  }
  const auto tiles = store->tiles().index();
  if (!tiles) return failure(tiles);
  if (tiles->empty()) return html;
  const auto global = global_map_images(run);
  if (!global) return failure(global);
  return html + *global;
}

}  // namespace spartan::internal
