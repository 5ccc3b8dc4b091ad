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

namespace spartan {
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
PointCloud cloud_of(const MergedRange& merged, const Pose& map_from_body) {
  PointCloud cloud;
  const Pose map_from_centre = map_from_body * merged.body_from_centre;
  for (int y = 0; y < merged.range_m.height(); ++y) {
    for (int x = 0; x < merged.range_m.width(); ++x) {
      const double range = merged.range_m(x, y);
      if (!std::isfinite(range)) continue;
      const Eigen::Vector3d position = map_from_centre * Eigen::Vector3d(range * merged.camera.direction(x, y));
      const std::uint8_t gray = merged.gray(x, y);
      cloud.push_back({position.cast<float>(), {gray, gray, gray}});
    }
  }
  return cloud;
}

Status write_view(const StopView& view, const VDisparityOptions& options, const std::string& folder) {
  if (!view.ground) return {};
  const std::string path = fmt::format("{}/{}_{}", folder, view.pair, view.stamp.ns);
  if (Status s = write_png(path + "_classes.png", render_classes(view.left, view.ground->classes)); !s) return s;
  return write_png(path + "_v_disparity.png", render_v_disparity(*view.ground, view.geometry.stereo, options));
}

}  // namespace

Status write_local_map(const LocalMap& map, const std::string& path) {
  if (Status s = write_geotiff(path + ".tif", map.place, map.bands().list); !s) return s;
  const std::string title = "Map " + std::filesystem::path(path).filename().string();
  return write_png(path + ".png", to_image(map_plot(map.elevation_m, map.kind, map.place, title)));
}

Status write_map_geotiff(const MapView& view, const MapOptions& options, const ThreadPool& workers,
                         const std::string& path) {
  const Traversability shape = view.shape(options, workers);
  return write_geotiff(path, view.place(), view.bands(shape).list);
}

Status write_global_map(GlobalMap& map, const MapOptions& options, const ThreadPool& workers, const std::string& path) {
  if (map.empty()) return {};
  const auto view = map.view(map.extent());
  if (!view) return failure(view);
  if (Status s = write_map_geotiff(*view, options, workers, path + ".tif"); !s) return s;
  return write_png(path + ".png", draw_map(*view, "Global map"));
}

Image<Rgb8> draw_map(const MapView& view, const std::string& title) {
  return to_image(map_plot(view.elevation_m, view.kind, view.place(), title));
}

Status remove_map_files(const std::string& path) {
  for (const char* extension : {".tif", ".png"}) {
    std::error_code error;
    std::filesystem::remove(path + extension, error);
    if (error) return failure(ErrorCode::output, "cannot be removed: " + error.message(), path + extension);
  }
  return {};
}

Status write_stop_files(std::span<const StopView> views, const MergedRange& merged, const LocalMap& map,
                        const MappingOptions& options, const std::string& folder) {
  if (Status s = write_local_map(map, folder + "/map"); !s) return s;
  if (Status s = write_file_atomically(folder + "/obstacles.csv", obstacle_table(map)); !s) return s;
  if (Status s = write_pfm(folder + "/range.pfm", merged.range_m); !s) return s;
  if (Status s = write_pfm(folder + "/range_sigma.pfm", merged.sigma_m); !s) return s;
  if (Status s = write_png(folder + "/panorama.png", merged.gray); !s) return s;
  if (Status s = write_png(folder + "/coverage.png", render_view_coverage(merged.views)); !s) return s;
  if (Status s = write_ply(folder + "/points.ply", cloud_of(merged, map.map_from_body)); !s) return s;
  for (const StopView& view : views) {
    if (Status s = write_view(view, options.v_disparity, folder); !s) return s;
  }
  return {};
}

}  // namespace spartan
