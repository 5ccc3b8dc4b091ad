#include "spartan/report/internal/map_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "spartan/figures/html.h"
#include "spartan/figures/map_plot.h"
#include "spartan/reconstruction/rendering.h"
#include "spartan/storage/geotiff.h"
#include "spartan/system/map_files.h"
#include "spartan/system/run_folder.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {
namespace {

constexpr int kMostMaps = 6;
constexpr double kMostDecades = 4;  // of points in a cell

// The names of MatchStatus with spaces.
std::string status_text(std::string status) {
  if (status == "decided") return "accepted";
  std::replace(status.begin(), status.end(), '_', ' ');
  return status;
}

bool fits_an_image(const GlobalMap& map) {
  return map.extent().cells() <= GlobalMap::kMostCells;
}

Result<std::string> local_map_figure(const MapRecord& map, const std::string& path, bool heading_east) {
  const auto tif = read_geotiff(path);
  if (!tif) return failure(tif);
  const auto band = [&](const std::string& name) {
    return std::find(tif->names.begin(), tif->names.end(), name) - tif->names.begin();
  };
  const auto elevation = static_cast<std::size_t>(band("elevation_m")), kind = static_cast<std::size_t>(band("class"));
  if (elevation >= tif->bands.size() || kind >= tif->bands.size())
    return failure(ErrorCode::input, "has no layers `elevation_m` and `class`", path);
  const Image<float>& classes = tif->bands[kind];
  Image<GroundClass> kinds(classes.width(), classes.height());
  for (int y = 0; y < classes.height(); ++y) {
    for (int x = 0; x < classes.width(); ++x) kinds(x, y) = static_cast<GroundClass>(static_cast<int>(classes(x, y)));
  }
  const std::string place = map.position_id >= 0
                                ? fmt::format("Stop {}, {} views", map.position_id, map.views)
                                : fmt::format("Keyframe at {:.2f} s", seconds_between(Stamp(), map.stamp));
  const std::string overlap = map.overlap > 0 ? fmt::format(" ({:.0f} % overlap)", 100 * map.overlap) : "";
  Plot plot = map_plot(tif->bands[elevation], kinds, tif->place,
                       fmt::format("{}: {} cells, {} obstacles; match with the global map: {}{}", place,
                                   map.known_cells, map.obstacles, status_text(map.status), overlap));
  plot.x_label = heading_east ? "x (east), m" : "x (start heading), m";
  plot.width_px = plot.height_px = 520;
  const Eigen::Vector3d at = map.world_from_body.pose.translation(),
                        ahead = map.world_from_body.pose.rotation() * Eigen::Vector3d::UnitX();
  plot.markers = {{"rover", {20, 20, 20}, at.x(), at.y(), std::atan2(ahead.y(), ahead.x())}};
  return to_html(plot);
}

// Number of points in each cell of the global map.
Result<std::string> coverage_figure(GlobalMap& map, bool heading_east) {
  const auto view = map.view(map.extent());
  if (!view) return failure(view);
  Plot plot = map_plot(view->elevation_m, view->kind, view->place(), "Points in each cell of the global map");
  Image<Rgb8> image(view->count.width(), view->count.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double count = view->count(x, y);
      image(x, y) = count > 0 ? elevation_colour(std::log10(count) / kMostDecades) : kUnknownColour;
    }
  }
  constexpr int kMostWidth_px = 1600;
  const GeoTransform place = view->place();
  plot.picture = PlotPicture{"points",
                             shrunk(image.view(), kMostWidth_px),
                             {place.west_m, place.west_m + image.width() * place.cell_m},
                             {place.north_m - image.height() * place.cell_m, place.north_m}};
  plot.colour_bar = ColourBar{"log10 of the number of points", {0, kMostDecades}, elevation_colour};
  plot.keys = {{"unknown", kUnknownColour}};
  plot.x_label = heading_east ? "x (east), m" : "x (start heading), m";
  plot.width_px = plot.height_px = 640;
  return to_html(plot);
}

}  // namespace

Result<std::optional<Plot>> global_map_plot(const std::string& run) {
  auto store = RunStore::open_read_only(RunFolder{run}.store());
  if (!store) return failure(store);
  const auto tiles = store->tiles().index();
  if (!tiles) return failure(tiles);
  if (tiles->empty()) return std::nullopt;
  auto saved = SavedMap::open(run);
  if (!saved) return failure(saved);
  if (!fits_an_image(saved->map())) return std::nullopt;
  const auto view = saved->map().view(saved->map().extent());
  if (!view) return failure(view);
  return map_plot(view->elevation_m, view->kind, view->place(), "Global map");
}

Result<std::string> map_section(const std::string& run, bool heading_east) {
  const RunFolder folder{run};
  auto store = RunStore::open_read_only(folder.store());
  if (!store) return failure(store);
  const auto maps = store->maps();
  if (!maps) return failure(maps);
  const auto tiles = store->tiles().index();
  if (!tiles) return failure(tiles);
  std::string html;
  if (!tiles->empty()) {
    auto saved = SavedMap::open(run);
    if (!saved) return failure(saved);
    GlobalMap& map = saved->map();
    if (fits_an_image(map)) {
      const auto coverage = coverage_figure(map, heading_east);
      if (!coverage) return failure(coverage);
      html += *coverage;
    } else {
      html += fmt::format(
          "<p>The global map, {:.0f} m × {:.0f} m, is too large for one image: <code>spartan map export "
          "--window</code> shows a part of it.</p>\n",
          map.extent().width * map.cell_m(), map.extent().height * map.cell_m());
    }
  }
  const auto count = std::min<std::size_t>(kMostMaps, maps->size());
  if (count > 0) html += fmt::format("<h3>{} of {} local maps</h3>\n<div class=\"plots\">", count, maps->size());
  for (std::size_t i = 0; i < count; ++i) {
    const MapRecord& map = (*maps)[count > 1 ? i * (maps->size() - 1) / (count - 1) : 0];
    const auto figure = local_map_figure(map, folder.local_map(map.stamp) + ".tif", heading_east);
    if (!figure) return failure(figure);
    html += *figure;
  }
  return html + (count > 0 ? "</div>\n" : "");
}

}  // namespace spartan::internal
