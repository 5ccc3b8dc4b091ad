#include "spartan/odometry/view_matching.h"

#include <cmath>
#include <memory>
#include <optional>

#include "spartan/odometry/internal/detection/landmark_detector.h"
#include "spartan/odometry/internal/matching/descriptor_matches.h"
#include "spartan/odometry/internal/matching/patch_alignment.h"
#include "spartan/odometry/internal/matching/smoothed_image.h"

namespace spartan {

using namespace internal;

namespace {

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
  SmoothedImage left_smooth, right_smooth;
  left_smooth.compute(left, workers);
  right_smooth.compute(right, workers);

  std::vector<ViewMatch> matches;
  for (const DescriptorMatch& pair : mutual_matches(left_features, right_features, options.descriptor_ratio, workers)) {
    const Feature &left_feature = left_features[static_cast<std::size_t>(pair.first)],
                  &right_feature = right_features[static_cast<std::size_t>(pair.second)];
    if (const auto match = align(left_feature, right_feature, left_smooth.view(), right_smooth.view(), options)) {
      matches.push_back(*match);
    }
  }
  return matches;
}

}  // namespace spartan
