#include "spartan/reconstruction/position_mapper.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace spartan {
namespace {

constexpr double kUnknownHeight_m = 1;      // scale of the search where the eye's height is not known
constexpr double kNearestPanorama_m = 0.3;  // nothing of interest is nearer to the virtual camera

// Adds the time since it was made or last asked.
class Lap {
 public:
  double milliseconds() {
    const auto now = std::chrono::steady_clock::now();
    const double passed = std::chrono::duration<double, std::milli>(now - since_).count();
    since_ = now;
    return passed;
  }

 private:
  std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
};

// Between the eyes.
Eigen::Vector3d middle_of(const ViewGeometry& view) {
  return view.body_from_left * Eigen::Vector3d(0.5 * view.stereo.baseline_m, 0, 0);
}

Pose centre_of(std::span<const PositionView> views) {
  double longest = 0;
  for (const PositionView& view : views) longest = std::max(longest, view.geometry.stereo.baseline_m);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const PositionView& view : views) {
    if (view.geometry.stereo.baseline_m < 0.999 * longest) continue;
    sum += middle_of(view.geometry);
    ++count;
  }
  return Pose::from_translation(sum / count);
}

}  // namespace

PositionMapper::PositionMapper(const DisparityOptions& disparity, const MappingOptions& options, Workers workers)
    : options_(options), workers_(workers), computer_(disparity, workers), generator_(options.map, workers) {}

Status PositionMapper::check(const RectifiedPair& shot, double nearest_m) {
  return DisparityComputer::check(shot.left, shot.right, disparity_range(shot.geometry, nearest_m), shot.left_mask,
                                  shot.right_mask);
}

Status PositionMapper::add(const RectifiedPair& shot, double nearest_m, const Eigen::Vector3d& up_in_body) {
  Lap lap;
  const auto image = computer_.compute(shot.left, shot.right, disparity_range(shot.geometry, nearest_m), shot.left_mask,
                                       shot.right_mask);
  if (!image) return failure(image);
  times_.disparity += lap.milliseconds();
  const double height = shot.body_from_left.translation().dot(up_in_body);
  const GroundPlane expected{shot.body_from_left.rotation().conjugate() * up_in_body,
                             height > 0.05 ? height : kUnknownHeight_m};
  auto ground = compute_v_disparity(image->disparity, shot.geometry, expected, options_.v_disparity, workers_);
  times_.v_disparity += lap.milliseconds();
  views_.push_back({shot.pair,
                    shot.stamp,
                    {shot.geometry, shot.body_from_left},
                    Image<float>::copy_of(image->disparity),
                    Image<std::uint8_t>::copy_of(shot.left),
                    std::move(ground)});
  return {};
}

MergedRange PositionMapper::merge() {
  Lap lap;
  std::vector<ViewGeometry> geometries;
  std::vector<MergedView> merged_views;
  for (const PositionView& view : views_) {
    geometries.push_back(view.geometry);
    merged_views.push_back({view.geometry, view.disparity, view.left,
                            view.ground ? view.ground->classes.view() : ImageView<const std::uint8_t>()});
  }
  const DisparityMerger merger(options_.merging, centre_of(views_), geometries, kNearestPanorama_m, workers_);
  MergedRange merged = merger.merge(merged_views);
  times_.merging += lap.milliseconds();
  return merged;
}

LocalMap PositionMapper::map(std::span<const SurfacePoint> points, const Pose& map_from_body) {
  Lap lap;
  LocalMap map = generator_.generate(points, map_from_body);
  times_.map += lap.milliseconds();
  return map;
}

}  // namespace spartan
