#include "spartan/system/internal/map_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/stop_mapper.h"

namespace spartan::internal {
namespace {

constexpr double kDisparitySigma_px = 0.3;
constexpr double kRelativeRangeSigma = 0.022;
constexpr double kCellsPerSide = 160, kCellsPerHeight = 8;
constexpr double kCellOfDefaults_m = 0.05;  // for which the defaults of mapping and slam were chosen
constexpr double kLeastHeight_m = 0.05;     // of a camera; a rig that states less does not state it
constexpr double kLeastUpright = 0.5;       // of the up axis of the image along the normal of the ground: 60°
constexpr std::size_t kMostFrames = 5;      // that are searched for a ground plane

// The nearest of 1, 1.2, 1.5 … 8 times a power of ten, by ratio.
double rounded(double value) {
  constexpr std::array kSteps{1.0, 1.2, 1.5, 2.0, 2.4, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0};
  const double exponent = std::floor(std::log10(value)), power = std::pow(10.0, std::abs(exponent));
  const double mantissa = exponent < 0 ? value * power : value / power;
  const auto distance = [&](double step) { return std::abs(std::log(step / mantissa)); };
  const double best =
      *std::min_element(kSteps.begin(), kSteps.end(), [&](double a, double b) { return distance(a) < distance(b); });
  return exponent < 0 ? best / power : best * power;
}

// Horizontal distance of the ground that the middle of the top row sees; infinite where it sees the sky.
double farthest_ground_m(const PairOverGround& pair) {
  if (!pair.height_m) return std::numeric_limits<double>::infinity();
  const Eigen::Vector3d ray(0, -pair.geometry.centre_px.y() / pair.geometry.focal_px, 1);
  const double down = -pair.up_in_left.dot(ray) / ray.norm();
  if (down <= 0) return std::numeric_limits<double>::infinity();
  return *pair.height_m * std::sqrt(1 - std::min(1.0, down * down)) / down;
}

double half_side_m(const PairOverGround& pair) {
  const double accurate_m =
      kRelativeRangeSigma * pair.geometry.focal_px * pair.geometry.baseline_m / kDisparitySigma_px;
  return std::min(accurate_m, farthest_ground_m(pair));
}

// The pair at its first frame that can be decoded; its height only where the rig states it, or from the images.
struct SeenPair {
  PairOverGround over_ground;
  bool height_by_images = false;
  std::optional<Eigen::Vector3d> up_in_body;  // with height_by_images
};

Result<std::optional<SeenPair>> look(SampleStream& source, Imager& imager, StopMapper& mapper, const StereoPair& pair) {
  std::optional<SeenPair> seen;
  for (std::size_t i = 0; i < std::min(kMostFrames, source.previews(pair.name)); ++i) {
    const auto frame = source.preview(pair.name, i);
    if (!frame && frame.error().code != ErrorCode::input) return failure(frame);
    if (!frame) continue;
    const auto rectified = imager.process(*frame);
    if (!rectified || !StopMapper::check(*rectified, pair.nearest_m)) continue;
    const Pose& body_from_left = rectified->body_from_left;
    seen.emplace();
    seen->over_ground.geometry = rectified->geometry;
    seen->over_ground.up_in_left = body_from_left.rotation().conjugate() * Eigen::Vector3d::UnitZ();
    if (const double height = body_from_left.translation().z(); height >= kLeastHeight_m) {
      seen->over_ground.height_m = height;
      return seen;
    }
    mapper.leave();
    if (!mapper.add(*rectified, pair.nearest_m)) continue;
    if (const auto& ground = mapper.views().front().ground) {
      seen->over_ground.up_in_left = ground->plane.up;
      seen->over_ground.height_m = ground->plane.height_m;
      seen->height_by_images = true;
      if (-ground->plane.up.y() > kLeastUpright) seen->up_in_body = body_from_left.rotation() * ground->plane.up;
      return seen;
    }
  }
  return seen;
}

}  // namespace

MapScale map_scale(std::span<const PairOverGround> pairs) {
  MapScale scale;
  if (pairs.empty()) return scale;
  const PairOverGround& farthest = *std::max_element(
      pairs.begin(), pairs.end(), [](const auto& a, const auto& b) { return half_side_m(a) < half_side_m(b); });
  scale.side_m = std::clamp(rounded(2 * half_side_m(farthest)), 1.0, 1000.0);
  scale.camera_height_m = farthest.height_m;
  const double by_height = farthest.height_m ? *farthest.height_m / kCellsPerHeight : scale.side_m;
  scale.cell_m = std::clamp(rounded(std::min(scale.side_m / kCellsPerSide, by_height)), 0.005, 10.0);
  return scale;
}

Result<MapScale> map_scale_of(SampleStream& source, const Rig& rig, const RunOptions& options,
                              const ThreadPool& workers, const std::string& mask_folder) {
  auto imager = Imager::create(rig, options.imaging, workers, mask_folder);
  if (!imager) return failure(imager);
  auto mapper = StopMapper::create(options.reconstruction, options.mapping, workers);
  if (!mapper) return failure(mapper);
  std::vector<PairOverGround> pairs;
  std::optional<Eigen::Vector3d> up_in_body;
  const StereoPair* const odometry_pair = odometry_pair_of(rig, options);
  bool by_images = false;
  for (const StereoPair& pair : rig.pairs) {
    auto seen = look(source, *imager, *mapper, pair);
    if (!seen) return failure(seen);
    if (!*seen) continue;
    pairs.push_back((*seen)->over_ground);
    by_images = by_images || (*seen)->height_by_images;
    if (&pair == odometry_pair) up_in_body = (*seen)->up_in_body;
  }
  MapScale scale = map_scale(pairs);
  scale.height_by_images = by_images;
  scale.up_in_body = up_in_body;
  return scale;
}

RunOptions with_map_scale(RunOptions options, const MapScale& scale, const GivenKeys& given) {
  const RunOptions defaults;
  const auto set = [&](const char* key, double& value, double by_default, double scaled) {
    if (!given.contains(key) && value == by_default) value = scaled;
  };
  MapOptions& map = options.mapping.map;
  const MapOptions& map_defaults = defaults.mapping.map;
  set("mapping.map.extent_m", map.extent_m, map_defaults.extent_m, scale.side_m);
  set("mapping.map.cell_m", map.cell_m, map_defaults.cell_m, scale.cell_m);
  set("mapping.map.obstacle_m", map.obstacle_m, map_defaults.obstacle_m, 2 * map.cell_m);
  set("mapping.map.cavity_m", map.cavity_m, map_defaults.cavity_m, 2 * map.cell_m);
  set("mapping.merging.max_range_m", options.mapping.merging.max_range_m, defaults.mapping.merging.max_range_m,
      0.75 * map.extent_m);
  set("slam.map.submap_m", options.slam.map.submap_m, defaults.slam.map.submap_m, 1.5 * map.extent_m);
  if (map.cell_m == kCellOfDefaults_m) return options;
  const double factor = map.cell_m / kCellOfDefaults_m;
  const auto grow = [&](const char* key, double& value, double by_default) {
    set(key, value, by_default, factor * by_default);
  };
  GroundSurfaceOptions& ground = map.ground;
  const GroundSurfaceOptions& ground_defaults = map_defaults.ground;
  grow("mapping.map.ground.window_m", ground.window_m, ground_defaults.window_m);
  grow("mapping.map.ground.node_spacing_m", ground.node_spacing_m, ground_defaults.node_spacing_m);
  grow("mapping.map.ground.initial_scale_m", ground.initial_scale_m, ground_defaults.initial_scale_m);
  grow("mapping.map.ground.final_scale_m", ground.final_scale_m, ground_defaults.final_scale_m);
  MatchOptions& match = options.slam.match;
  const MatchOptions& match_defaults = defaults.slam.match;
  grow("slam.match.max_search_m", match.max_search_m, match_defaults.max_search_m);
  grow("slam.match.step_m", match.step_m, match_defaults.step_m);
  grow("slam.match.elevation_scale_m", match.elevation_scale_m, match_defaults.elevation_scale_m);
  grow("slam.match.block_m", match.block_m, match_defaults.block_m);
  grow("slam.match.common_error_area_m", match.common_error_area_m, match_defaults.common_error_area_m);
  grow("slam.match.max_sigma_m", match.max_sigma_m, match_defaults.max_sigma_m);
  grow("slam.map.min_sigma_m", options.slam.map.min_sigma_m, defaults.slam.map.min_sigma_m);
  return options;
}

std::string to_text(const MapScale& scale, const RunOptions& used) {
  const MapOptions& map = used.mapping.map;
  const std::string height = scale.camera_height_m
                                 ? fmt::format("camera {:.2f} m above the ground, by the {}", *scale.camera_height_m,
                                               scale.height_by_images ? "images" : "rig")
                                 : std::string("height of the camera unknown");
  return fmt::format("side {} m, cells of {} m, obstacles from {} m ({})", map.extent_m, map.cell_m, map.obstacle_m,
                     height);
}

}  // namespace spartan::internal
