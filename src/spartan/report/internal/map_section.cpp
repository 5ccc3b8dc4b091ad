#include "spartan/report/internal/map_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "spartan/figures/map_plot.h"
#include "spartan/reconstruction/rendering.h"
#include "spartan/report/internal/page_parts.h"
#include "spartan/storage/geotiff.h"
#include "spartan/system/map_files.h"
#include "spartan/system/run_folder.h"

namespace spartan::internal {
namespace {

constexpr std::size_t kMostMaps = 6;
constexpr std::int64_t kMostOverviewCells = 1'000'000;
constexpr double kMostDecades = 4;  // of points in a cell

// The names of MatchStatus with spaces.
std::string status_text(std::string status) {
  if (status == "decided") return "accepted";
  std::replace(status.begin(), status.end(), '_', ' ');
  return status;
}

Image<GroundClass> classes_of(const Image<float>& band) {
  Image<GroundClass> kinds(band.width(), band.height(), GroundClass::unknown);
  for (int y = 0; y < band.height(); ++y) {
    for (int x = 0; x < band.width(); ++x) {
      for (const GroundClass kind : {GroundClass::ground, GroundClass::obstacle, GroundClass::cavity}) {
        if (band(x, y) == static_cast<float>(kind)) kinds(x, y) = kind;
      }
    }
  }
  return kinds;
}

std::string title_of(const MapRecord& map) {
  const std::string place = map.position_id >= 0
                                ? fmt::format("Stop {}, {} views", map.position_id, map.views)
                                : fmt::format("Keyframe at {:.2f} s", seconds_between(Stamp(), map.stamp));
  const std::string overlap = map.overlap > 0 ? fmt::format(" ({:.0f} % overlap)", 100 * map.overlap) : "";
  return fmt::format("{}: {} cells, {} obstacles; match with the global map: {}{}", place, map.known_cells,
                     map.obstacles, status_text(map.status), overlap);
}

Result<std::string> local_map_figure(const MapRecord& map, const std::string& path, bool heading_east) {
  const auto tif = read_geotiff(path);
  if (!tif) return failure(tif);
  const auto band = [&](const char* name) -> const Image<float>* {
    const auto found = std::find(tif->names.begin(), tif->names.end(), name);
    return found == tif->names.end() ? nullptr : &tif->bands[static_cast<std::size_t>(found - tif->names.begin())];
  };
  const Image<float>*elevation_m = band("elevation_m"), *classes = band("class");
  if (elevation_m == nullptr || classes == nullptr)
    return failure(ErrorCode::input, "has no layers `elevation_m` and `class`", path);
  Plot plot = map_plot(*elevation_m, classes_of(*classes), tif->place, title_of(map));
  name_world_axes(plot, heading_east);
  plot.width_px = plot.height_px = 520;
  plot.markers = {rover_marker("rover", map.world_from_body.pose)};
  return to_html(plot);
}

// Number of points in each cell.
Plot coverage_plot(const MapView& view) {
  Image<Rgb8> image(view.count.width(), view.count.height());
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const double count = view.count(x, y);
      image(x, y) = count > 0 ? elevation_colour(std::log10(count) / kMostDecades) : kUnknownColour;
    }
  }
  Plot plot = ground_plot(std::move(image), view.place(), "Points in each cell of the global map", "points");
  plot.colour_bar = ColourBar{"log10 of the number of points", {0, kMostDecades}, elevation_colour};
  plot.keys = {{"unknown", kUnknownColour}};
  plot.width_px = plot.height_px = 640;
  return plot;
}

}  // namespace

Result<GlobalMapFigures> global_map_figures(const std::string& run, RunStore& store, bool heading_east) {
  GlobalMapFigures figures;
  const auto tiles = store.tiles().index();
  if (!tiles) return failure(tiles);
  if (tiles->empty()) return figures;
  auto saved = SavedMap::open(run);
  if (!saved) return failure(saved);
  GlobalMap& map = saved->map();
  const LatticeWindow extent = map.extent();
  const bool all = extent.cells() <= GlobalMap::kMostCells;
  const auto view = all ? map.view(extent) : map.overview(map.overview_step(kMostOverviewCells));
  if (!view) return failure(view);
  figures.map = map_plot(view->elevation_m, view->kind, view->place(), "Global map");
  Plot coverage = coverage_plot(*view);
  if (!all) coverage.title += fmt::format(", summarized in cells of {:.2g} m", view->cell_m);
  name_world_axes(coverage, heading_east);
  figures.coverage = to_html(coverage);
  return figures;
}

Result<std::string> local_map_figures(const std::string& run, RunStore& store, bool heading_east) {
  const auto maps = store.maps();
  if (!maps) return failure(maps);
  if (maps->empty()) return std::string();
  const std::vector<std::size_t> shown = spread_indices(maps->size(), kMostMaps);
  std::string html = fmt::format("<h3>{} of {} local maps</h3>\n<div class=\"plots\">", shown.size(), maps->size());
  for (const std::size_t i : shown) {
    const MapRecord& map = (*maps)[i];
    const auto figure = local_map_figure(map, RunFolder{run}.local_map(map.stamp) + ".tif", heading_east);
    if (!figure) return failure(figure);
    html += *figure;
  }
  return html + "</div>\n";
}

}  // namespace spartan::internal
