#include "spartan/slam/internal/blank_map_view.h"

#include <fmt/format.h>

#include <limits>

namespace spartan::internal {

Result<MapView> blank_map_view(const LatticeWindow& window, double cell_m, std::int64_t most_cells) {
  if (window.cells() > most_cells) {
    return failure(
        ErrorCode::usage,
        fmt::format("the window has {} x {} cells, more than the limit of a view", window.width, window.height), "",
        "`spartan map export --window` exports a part of the map");
  }
  MapView view;
  view.window = window;
  view.cell_m = cell_m;
  for (Image<float>* layer :
       {&view.elevation_m, &view.elevation_min_m, &view.elevation_max_m, &view.variance_m2, &view.common_variance_m2})
    *layer = Image<float>(window.width, window.height, std::numeric_limits<float>::quiet_NaN());
  for (Image<float>* layer : {&view.count, &view.occupancy_logodds})
    *layer = Image<float>(window.width, window.height, 0.0F);
  view.kind = Image<GroundClass>(window.width, window.height);
  view.stop = Image<std::int32_t>(window.width, window.height, -1);
  return view;
}

}  // namespace spartan::internal
