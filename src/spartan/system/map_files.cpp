#include "spartan/system/map_files.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "spartan/core/files.h"
#include "spartan/figures/map_plot.h"
#include "spartan/image_io/image_io.h"
#include "spartan/reconstruction/point_cloud.h"
#include "spartan/reconstruction/rendering.h"
#include "spartan/storage/geotiff.h"
#include "spartan/system/internal/map_description.h"

namespace spartan {

using namespace internal;

namespace {

std::string obstacle_table(const LocalMap& map) {
  std::string text = "x_m,y_m,width_m,length_m,height_m,cells\n";
  for (const Obstacle& o : map.obstacles) {
    text += fmt::format("{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},{}\n", o.middle_m.x(), o.middle_m.y(), o.width_m,
                        o.length_m, o.height_m, o.cells);
  }
  return text;
}

// Points in the map frame, with gray levels as colours.
PointCloud cloud_of(const MergedRange& merged, const Pose& map_from_body, const Stamp& stamp) {
  PointCloud cloud;
  const Pose map_from_centre = map_from_body * merged.body_from_centre;
  for (int y = 0; y < merged.range_m.height(); ++y) {
    for (int x = 0; x < merged.range_m.width(); ++x) {
      const double range = merged.range_m(x, y);
      if (!std::isfinite(range)) continue;
      const Eigen::Vector3d position = map_from_centre * Eigen::Vector3d(range * merged.camera.direction(x, y));
      const std::uint8_t gray = merged.gray(x, y);
      cloud.push_back({position.cast<float>(), {gray, gray, gray}, merged.sigma_m(x, y), stamp.seconds()});
    }
  }
  return cloud;
}

// A pixel for each of the panorama, as range.pfm and panorama.png have them.
Image<Rgb8> draw_coverage(const MergedRange& merged, std::span<const StopView> views) {
  Image<Rgb8> pixels = render_view_coverage(merged.views);
  // Azimuth to the right, and elevation or its tangent, of the borders: half a pixel outside of the outer centres.
  const bool sphere = merged.camera.projection() == PanoramicCamera::Projection::sphere;
  const double per_column = 1 / (merged.camera.per_radian() * kRadiansPerDegree),
               per_row = sphere ? per_column : 1 / merged.camera.per_radian();
  const Eigen::Vector3d corner = merged.camera.direction(0, 0);
  const double top = corner.z() / std::hypot(corner.x(), corner.y());
  const double left = -std::atan2(corner.y(), corner.x()) / kRadiansPerDegree - 0.5 * per_column,
               highest = (sphere ? std::atan(top) / kRadiansPerDegree : top) + 0.5 * per_row;
  const Range columns{left, left + pixels.width() * per_column}, rows{highest - pixels.height() * per_row, highest};
  Plot plot;
  plot.title = "Views of the panorama";
  plot.x_label = "azimuth to the right, deg";
  plot.y_label = sphere ? "elevation, deg" : "tangent of the elevation";
  plot.width_px = kPlotMargin_px + pixels.width();
  plot.height_px = kPlotHeading_px + pixels.height();
  plot.image = PlotImage{"views", std::move(pixels), columns, rows};
  for (std::size_t i = 0; i < views.size(); ++i)
    plot.keys.push_back({fmt::format("view {}: {}", i + 1, views[i].pair), view_colour(i)});
  return to_image(plot);
}

Status write_view(const StopView& view, const VDisparityOptions& options, const std::string& folder) {
  if (!view.ground) return {};
  const std::string path = fmt::format("{}/{}_{}", folder, view.pair, view.stamp.ns);
  const Image<Rgb8> classes =
      titled_image(render_classes(view.left, view.ground->classes), "Classes of the pixels, pair " + view.pair,
                   {{"ground", kGroundColour}, {"obstacle", kObstacleColour}, {"cavity", kCavityColour}});
  if (Status s = write_png(path + "_classes.png", classes); !s) return s;
  const Image<Rgb8> v_disparity = titled_image(
      render_v_disparity(*view.ground, view.geometry.stereo, options),
      "Row (down) against disparity (right), pair " + view.pair,
      {{"ground", kGroundProfileColour}, {"obstacle from", kObstacleColour}, {"cavity from", kCavityColour}});
  return write_png(path + "_v_disparity.png", v_disparity);
}

// Figures of the views of an earlier stop.
void remove_views(const std::string& folder) {
  const auto names = list_folder(folder);
  if (!names) return;
  std::error_code ignored;
  for (const std::string& name : *names) {
    if (name.ends_with("_classes.png") || name.ends_with("_v_disparity.png"))
      std::filesystem::remove(std::filesystem::path(folder) / name, ignored);
  }
}

}  // namespace

Status write_local_map(const LocalMap& map, const MapContext& about, const std::string& path) {
  if (Status s = write_geotiff(path + ".tif", map.place, map.bands().list, map_description(about)); !s) return s;
  const std::string title = "Map " + std::filesystem::path(path).filename().string();
  return write_png(path + ".png", to_image(map_plot(map.elevation_m, map.kind, map.place, title)));
}

Status write_global_map(GlobalMap& map, const MapOptions& options, std::optional<bool> x_is_east,
                        const ThreadPool& workers, const std::string& path) {
  if (map.empty()) return {};
  const auto view = map.view(map.extent());
  if (!view) return failure(view);
  MapExport request{MapFormat::geotiff, {}, options, {x_is_east, stamps_of(map)}};
  if (Status s = export_map(*view, request, workers, path + ".tif"); !s) return s;
  request.format = MapFormat::figure;
  return export_map(*view, request, workers, path + ".png");
}

Status remove_map_files(const std::string& path) {
  for (const std::string& file : {path + ".tif", geotiff_sidecar(path + ".tif"), path + ".png"}) {
    std::error_code error;
    std::filesystem::remove(file, error);
    if (error) return failure(ErrorCode::output, "cannot be removed: " + error.message(), file);
  }
  return {};
}

Status write_stop_files(std::span<const StopView> views, const MergedRange& merged, const LocalMap& map,
                        const MappingOptions& options, const std::string& folder) {
  const Stamp stamp = views.empty() ? Stamp() : views.front().stamp;
  MapContext about;
  if (stamp.ns != 0) about.stops[0] = stamp;  // images of a pair alone have no time
  if (Status s = write_local_map(map, about, folder + "/map"); !s) return s;
  if (Status s = write_file_atomically(folder + "/obstacles.csv", obstacle_table(map)); !s) return s;
  if (Status s = write_pfm(folder + "/range.pfm", merged.range_m); !s) return s;
  if (Status s = write_pfm(folder + "/range_sigma.pfm", merged.sigma_m); !s) return s;
  if (Status s = write_png(folder + "/panorama.png", merged.gray); !s) return s;
  if (Status s = write_png(folder + "/coverage.png", draw_coverage(merged, views)); !s) return s;
  if (Status s = write_ply(folder + "/points.ply", cloud_of(merged, map.map_from_body, stamp)); !s) return s;
  remove_views(folder);
  for (const StopView& view : views) {
    if (Status s = write_view(view, options.v_disparity, folder); !s) return s;
  }
  return {};
}

}  // namespace spartan
