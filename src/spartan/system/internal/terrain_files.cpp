#include "spartan/system/internal/terrain_files.h"

#include <cmath>

#include "spartan/image_io/image_io.h"
#include "spartan/reconstruction/point_cloud.h"
#include "spartan/reconstruction/rendering.h"

namespace spartan::internal {
namespace {

constexpr double kDisparityErrorPx = 0.3;  // disparity accuracy that the published rig is designed for

std::string stem(const std::string& folder, Stamp stamp) {
  return folder + "/" + std::to_string(stamp.ns);
}

double known_percent(ImageView<const float> disparity) {
  std::int64_t known = 0;
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) known += !std::isnan(disparity(x, y));
  }
  return 100.0 * static_cast<double>(known) / (static_cast<double>(disparity.width()) * disparity.height());
}

}  // namespace

Result<TerrainRecord> write_terrain(const TerrainView& view, const TerrainOptions& options, const std::string& folder) {
  const std::string path = stem(folder, view.stamp);
  // Δz / z = Δd / d: a bound on the relative range error is a lower bound on the disparity.
  const CloudSampling sampling{options.point_step_px, kDisparityErrorPx / options.max_range_error, options.max_range_m};
  const PointCloud cloud =
      to_point_cloud(view.disparity, view.sigma, view.left, view.geometry, view.world_from_left, view.stamp, sampling);
  if (Status s = write_pfm(path + ".pfm", view.disparity); !s) return failure(s);
  if (Status s = write_png(path + ".png", colour_disparity(view.disparity)); !s) return failure(s);
  if (Status s = write_ply(path + ".ply", cloud); !s) return failure(s);
  return TerrainRecord{view.stamp, view.pair, known_percent(view.disparity), static_cast<std::int64_t>(cloud.size())};
}

Result<PointCloud> terrain_cloud(const std::string& folder, const std::vector<TerrainRecord>& terrain) {
  if (terrain.empty()) return failure(ErrorCode::input, "contains no terrain", folder, "run without --odometry-only");
  PointCloud all;
  for (const TerrainRecord& record : terrain) {
    const auto cloud = read_ply(stem(folder, record.stamp) + ".ply");
    if (!cloud) return failure(cloud);
    all.insert(all.end(), cloud->begin(), cloud->end());
  }
  return all;
}

}  // namespace spartan::internal
