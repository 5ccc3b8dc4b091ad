#include "spartan/reconstruction/stop_mapper.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "spartan/core/stage_clock.h"
#include "spartan/reconstruction/internal/left_border.h"

namespace spartan {
namespace {

constexpr double kUnknownHeight_m = 1;      // scale of the ground search where the camera's height is unknown
constexpr double kNearestPanorama_m = 0.3;  // nearest depth that the virtual camera covers

// Midpoint between the left and the right camera.
Eigen::Vector3d pair_midpoint(const ViewGeometry& view) {
  return view.body_from_left * Eigen::Vector3d(0.5 * view.stereo.baseline_m, 0, 0);
}

Pose centre_of(std::span<const StopView> views) {
  double longest = 0;
  for (const StopView& view : views) longest = std::max(longest, view.geometry.stereo.baseline_m);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (const StopView& view : views) {
    if (view.geometry.stereo.baseline_m < 0.999 * longest) continue;
    sum += pair_midpoint(view.geometry);
    ++count;
  }
  return Pose::from_translation(sum / count);
}

// Disparities that are too unlikely, and those that were not measured but filled.
void discard_unlikely(const DisparityImage& image, int most_percent, ImageView<float> disparity) {
  for (int y = 0; y < disparity.height(); ++y) {
    for (int x = 0; x < disparity.width(); ++x) {
      if (image.outlier_percent(x, y) > most_percent || std::isnan(image.sigma(x, y)))
        disparity(x, y) = std::numeric_limits<float>::quiet_NaN();
    }
  }
}

}  // namespace

MappingOptions with_shared_values(MappingOptions options) {
  const MappingOptions defaults;
  const auto share = [](double& value, double by_default, double shared) {
    if (value == by_default) value = shared;
  };
  share(options.v_disparity.plane.disparity_sigma_px, defaults.v_disparity.plane.disparity_sigma_px,
        options.disparity_sigma_px);
  share(options.merging.disparity_sigma_px, defaults.merging.disparity_sigma_px, options.disparity_sigma_px);
  share(options.v_disparity.obstacle_m, defaults.v_disparity.obstacle_m, 4 * options.map.obstacle_m / 5);
  return options;
}

Result<StopMapper> StopMapper::create(const DisparityOptions& disparity, const MappingOptions& options,
                                      ThreadPool workers) {
  if (Status valid = validate(options, "mapping options"); !valid) return failure(valid);
  auto computer = DisparityComputer::create(disparity, workers);
  if (!computer) return failure(computer);
  auto generator = MapGenerator::create(options.map, workers);
  if (!generator) return failure(generator);
  return StopMapper(std::move(*computer), std::move(*generator), options, workers);
}

StopMapper::StopMapper(DisparityComputer computer, MapGenerator generator, const MappingOptions& options,
                       const ThreadPool& workers)
    : options_(with_shared_values(options)),
      workers_(workers),
      computer_(std::move(computer)),
      generator_(std::move(generator)) {}

Status StopMapper::check(const RectifiedPair& frame, double nearest_m) {
  return DisparityComputer::check(frame.left, frame.right, disparity_range(frame.geometry, nearest_m), frame.left_mask,
                                  frame.right_mask);
}

Status StopMapper::add(const RectifiedPair& frame, double nearest_m, const Eigen::Vector3d& up_in_body) {
  Stopwatch watch;
  const auto image = computer_.compute(frame.left, frame.right, disparity_range(frame.geometry, nearest_m),
                                       frame.left_mask, frame.right_mask);
  if (!image) return failure(image);
  times_.disparity += watch.lap();
  Image<float> disparity = Image<float>::copy_of(image->disparity);
  discard_unlikely(*image, options_.max_outlier_percent, disparity);
  const double height = frame.body_from_left.translation().dot(up_in_body);
  const GroundPlane expected{frame.body_from_left.rotation().conjugate() * up_in_body,
                             height > 0.05 ? height : kUnknownHeight_m};
  auto ground = compute_v_disparity(disparity, frame.geometry, expected, options_.v_disparity, workers_, image->sigma);
  if (ground) internal::drop_matches_below_ground(ground->plane, frame.geometry, disparity);
  times_.v_disparity += watch.lap();
  views_.push_back({frame.pair,
                    frame.stamp,
                    {frame.geometry, frame.body_from_left},
                    std::move(disparity),
                    Image<float>::copy_of(image->sigma),
                    Image<std::uint8_t>::copy_of(frame.left),
                    std::move(ground)});
  return {};
}

MergedRange StopMapper::merge() {
  Stopwatch watch;
  std::vector<ViewGeometry> geometries;
  std::vector<MergedView> merged_views;
  for (const StopView& view : views_) {
    geometries.push_back(view.geometry);
    merged_views.push_back({view.geometry, view.disparity, view.sigma, view.left,
                            view.ground ? view.ground->classes.view() : ImageView<const std::uint8_t>()});
  }
  const auto merger =  // StopMapper::create() has validated the options
      DisparityMerger::create(options_.merging, centre_of(views_), geometries, kNearestPanorama_m, workers_).value();
  MergedRange merged = merger.merge(merged_views);
  times_.merging += watch.lap();
  return merged;
}

LocalMap StopMapper::map(std::span<const SurfacePoint> points, const Pose& map_from_body) {
  Stopwatch watch;
  LocalMap map = generator_.generate(points, map_from_body);
  times_.map += watch.lap();
  return map;
}

}  // namespace spartan
