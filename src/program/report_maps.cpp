#include "program/report_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "program/html_parts.h"
#include "spartan/core/image_io.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan::program {
namespace {

constexpr int kMostMaps = 6;

Result<std::string> picture_of(const std::string& path, const std::string& caption, int width_px) {
  const auto image = read_image(path);
  if (!image) return failure(image);
  return html_picture(shrunk(image->as<Rgb8>(), width_px), caption, width_px);
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
    const auto picture = picture_of(folder.local_map(map.stamp) + ".png",
                                    fmt::format("Position {}: {} views, {} cells known, {} obstacles (red), north up",
                                                map.position_id, map.views, map.known_cells, map.obstacles),
                                    360);
    if (!picture) return failure(picture);
    html += *picture;
  }
  return html;
}

}  // namespace spartan::program
