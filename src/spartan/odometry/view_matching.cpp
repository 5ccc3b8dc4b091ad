#include "spartan/odometry/view_matching.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "spartan/odometry/internal/detection/landmark_detector.h"
#include "spartan/odometry/internal/matching/patch_alignment.h"
#include "spartan/odometry/internal/matching/smoothed_image.h"

namespace spartan {

using namespace internal;

namespace {

// Nearest of `others` by descriptor distance, with the distance of the second nearest.
struct Nearest {
  int index = -1;
  double distance = std::numeric_limits<double>::infinity();
  double second = std::numeric_limits<double>::infinity();
};

std::vector<Nearest> nearest_of(const std::vector<Feature>& features, const std::vector<Feature>& others,
                                const ThreadPool& workers) {
  std::vector<Nearest> result(features.size());
  workers.parallel_for(0, static_cast<int>(features.size()), 64, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      const Feature& feature = features[static_cast<std::size_t>(i)];
      Nearest& best = result[static_cast<std::size_t>(i)];
      for (std::size_t k = 0; k < others.size(); ++k) {
        if (others[k].sign != feature.sign) continue;
        const double distance = squared_distance(feature.descriptor, others[k].descriptor);
        if (distance < best.distance) {
          best.second = best.distance;
          best.distance = distance;
          best.index = static_cast<int>(k);
        } else {
          best.second = std::min(best.second, distance);
        }
      }
    }
  });
  return result;
}

std::optional<ViewMatch> align(const Feature& left, const Feature& right, ImageView<const std::uint16_t> left_smooth,
                               ImageView<const std::uint16_t> right_smooth, const ViewMatchingOptions& options) {
  // The left point is moved to the nearest whole pixel, the start in the right image by the same amount.
  const Eigen::Vector2d detected(left.x, left.y);
  const Eigen::Vector2d pixel = detected.array().round();
  const auto patch = cut_patch(left_smooth, static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
  if (!patch) return std::nullopt;
  const Eigen::Vector2d start = Eigen::Vector2d(right.x, right.y) + (pixel - detected);
  const AlignmentTemplate reference(*patch);
  const auto coarse =
      align_translation(reference, right_smooth, Eigen::Matrix2d::Identity(), start, options.correlation_radius_px);
  if (!coarse) return std::nullopt;
  const auto found = align_slanted(reference, right_smooth, coarse->position, options.correlation_radius_px);
  if (!found || found->match.correlation < options.min_correlation) return std::nullopt;
  return ViewMatch{pixel, found->match.position, std::sqrt(found->match.covariance(1, 1)), found->match.correlation};
}

}  // namespace

std::vector<ViewMatch> match_views(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                   const ViewMatchingOptions& options, const ThreadPool& workers) {
  DetectionOptions detection;
  detection.landmarks = options.features;
  const auto detector = make_landmark_detector(detection, workers);
  const std::vector<Feature> left_features = detector->detect(left, {});
  const std::vector<Feature> right_features = detector->detect(right, {});
  const auto from_left = nearest_of(left_features, right_features, workers);
  const auto from_right = nearest_of(right_features, left_features, workers);
  SmoothedImage left_smooth, right_smooth;
  left_smooth.compute(left, workers);
  right_smooth.compute(right, workers);

  std::vector<ViewMatch> matches;
  const double ratio = options.descriptor_ratio * options.descriptor_ratio;  // distances are squared
  for (std::size_t i = 0; i < left_features.size(); ++i) {
    const Nearest& best = from_left[i];
    if (best.index < 0 || !(best.distance < ratio * best.second)) continue;
    const auto other = static_cast<std::size_t>(best.index);
    if (from_right[other].index != static_cast<int>(i)) continue;
    if (const auto match =
            align(left_features[i], right_features[other], left_smooth.view(), right_smooth.view(), options)) {
      matches.push_back(*match);
    }
  }
  return matches;
}

}  // namespace spartan
