#include "spartan/odometry/internal/landmark_matcher.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace spartan::internal {
namespace {

/// Standard deviation of a detected feature's (u, v, d); used for the coarse motion only; empirical.
constexpr double kFeatureSigma_px = 1.0;
/// A distance between two landmarks has changed where it differs by more than this many standard deviations.
constexpr double kRigiditySigmas = 4.0;
/// Points of smaller disparity are too uncertain in depth for the rigidity check; empirical.
constexpr double kRigidityDisparity_px = 1.0;
/// Smallest variance of a disparity in the rigidity check, pixels².
constexpr double kMinRigidityVariance_px2 = 0.01;
/// A feature whose scale differs from the landmark's by more than this factor is no candidate.
constexpr float kMaxScaleRatio = 2;
/// Fewer matches than this are too few to outvote an outlier in the rigidity check.
constexpr std::size_t kMinRigidMatches = 8;
constexpr int kLandmarksPerPart = 16;
/// Landmarks that are searched in the pyramids: enough for RANSAC.
constexpr std::size_t kPyramidLandmarks = 200;

AnchoredPoint point_of(const Landmark& landmark) {
  return {landmark.anchor_pixel, landmark.disparity};
}

}  // namespace

std::vector<int> LandmarkMatcher::by_descriptor(const LandmarkMemory& memory,
                                                const std::vector<ReconstructedFeature>& features,
                                                const RectifiedStereo& stereo,
                                                const std::optional<Pose>& current_from_previous) const {
  struct Candidate {
    int feature = -1;
    double distance = 0;
  };
  std::vector<Candidate> best(memory.landmarks.size());
  const double max_squared = options_.max_descriptor_distance * options_.max_descriptor_distance;
  const double ratio = options_.descriptor_ratio * options_.descriptor_ratio;
  const double gate = current_from_previous ? options_.gate_px : std::numeric_limits<double>::infinity();
  const auto find = [&](const Landmark& landmark) -> Candidate {
    Eigen::Vector2d predicted = landmark.pixel;
    if (current_from_previous) {
      const auto p = project_anchored(stereo, point_of(landmark),
                                      *current_from_previous * memory.anchor(landmark.anchor_id).latest_from_anchor);
      if (!p) return {};
      predicted = p->measured.head<2>();
    }
    Candidate first{-1, 1e9}, second{-1, 1e9};
    for (std::size_t i = 0; i < features.size(); ++i) {
      const Feature& f = features[i].feature;
      if (f.sign != landmark.sign || std::abs(f.x - predicted.x()) > gate || std::abs(f.y - predicted.y()) > gate)
        continue;
      if (f.scale > kMaxScaleRatio * landmark.scale || landmark.scale > kMaxScaleRatio * f.scale) continue;
      const double distance = squared_distance(f.descriptor, landmark.descriptor);
      if (distance < first.distance) {
        second = first;
        first = {static_cast<int>(i), distance};
      } else if (distance < second.distance) {
        second = {static_cast<int>(i), distance};
      }
    }
    if (first.distance > max_squared || !(first.distance < ratio * second.distance)) return {};
    return first;
  };
  workers_.parallel_for(0, static_cast<int>(best.size()), kLandmarksPerPart, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      best[static_cast<std::size_t>(i)] = find(memory.landmarks[static_cast<std::size_t>(i)]);
    }
  });

  std::vector<int> owner(features.size(), -1), result(best.size(), -1);
  for (std::size_t i = 0; i < best.size(); ++i) {
    if (best[i].feature < 0) continue;
    int& current = owner[static_cast<std::size_t>(best[i].feature)];
    if (current >= 0 && best[static_cast<std::size_t>(current)].distance <= best[i].distance) continue;
    current = static_cast<int>(i);
  }
  for (std::size_t f = 0; f < owner.size(); ++f) {
    if (owner[f] >= 0) result[static_cast<std::size_t>(owner[f])] = static_cast<int>(f);
  }
  return result;
}

std::vector<LandmarkMatch> LandmarkMatcher::coarse_matches(const LandmarkMemory& memory,
                                                           const std::vector<ReconstructedFeature>& features,
                                                           const std::vector<int>& feature_of) const {
  std::vector<LandmarkMatch> matches;
  for (std::size_t i = 0; i < feature_of.size(); ++i) {
    if (feature_of[i] < 0) continue;
    const ReconstructedFeature& f = features[static_cast<std::size_t>(feature_of[i])];
    if (!f.stereo) continue;
    const Landmark& landmark = memory.landmarks[i];
    LandmarkMatch match;
    match.landmark = i;
    match.point = point_of(landmark);
    match.disparity_variance = landmark.variance;
    match.previous_from_anchor = memory.anchor(landmark.anchor_id).latest_from_anchor;
    match.measured = {f.feature.x, f.feature.y, f.stereo->disparity};
    match.covariance = kFeatureSigma_px * kFeatureSigma_px * Eigen::Matrix3d::Identity();
    matches.push_back(match);
  }
  return matches;
}

std::optional<LandmarkMatch> LandmarkMatcher::correlate(const LandmarkMemory& memory, std::size_t index,
                                                        const StereoImages& images, const Pose& current_from_previous,
                                                        const std::optional<Eigen::Vector2d>& start_px) const {
  const Landmark& landmark = memory.landmarks[index];
  LandmarkMatch match;
  match.landmark = index;
  match.point = point_of(landmark);
  match.disparity_variance = landmark.variance;
  match.previous_from_anchor = memory.anchor(landmark.anchor_id).latest_from_anchor;
  const auto predicted =
      project_anchored(images.geometry, match.point, current_from_previous * match.previous_from_anchor);
  if (!predicted) return std::nullopt;
  const AnchoredWarp warp = warp_of(*predicted, landmark.slant);
  if (!warp.pixels.allFinite() || !warp.slant.allFinite()) return std::nullopt;

  const AlignmentTemplate reference(landmark.patch);
  const auto found =
      align_translation(reference, images.left_smooth, warp.pixels, start_px.value_or(predicted->measured.head<2>()),
                        options_.correlation_radius_px);
  if (!found || found->correlation < options_.min_correlation) return std::nullopt;
  const int x = static_cast<int>(std::lround(found->position.x())),
            y = static_cast<int>(std::lround(found->position.y()));
  if (!images.left_mask.empty() && images.left_mask(x, y) == 0) return std::nullopt;

  RowAlignment start;
  start.disparity = predicted->measured.z();
  start.slant = warp.slant;
  const auto stereo = reconstruction_.refine(images, found->position, start, options_.disparity_radius_px);
  if (!stereo) return std::nullopt;
  match.measured << found->position, stereo->disparity;
  match.covariance.setZero();
  match.covariance.topLeftCorner<2, 2>() = found->covariance;
  match.covariance(2, 2) = stereo->sigma_px * stereo->sigma_px;
  return match;
}

std::vector<LandmarkMatch> LandmarkMatcher::collect(
    std::size_t count, const std::function<std::optional<LandmarkMatch>(std::size_t)>& measure) {
  found_.assign(count, std::nullopt);
  workers_.parallel_for(0, static_cast<int>(count), kLandmarksPerPart, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) found_[static_cast<std::size_t>(i)] = measure(static_cast<std::size_t>(i));
  });
  std::vector<LandmarkMatch> matches;
  matches.reserve(count);
  for (const auto& match : found_)
    if (match) matches.push_back(*match);
  return matches;
}

std::vector<LandmarkMatch> LandmarkMatcher::by_pyramid(const LandmarkMemory& memory, const StereoImages& images,
                                                       const ImagePyramid& latest, const ImagePyramid& current,
                                                       const Pose& current_from_previous) {
  const std::size_t all = memory.landmarks.size(), count = std::min(all, kPyramidLandmarks);
  return collect(count, [&](std::size_t k) -> std::optional<LandmarkMatch> {
    const std::size_t index = k * all / count;
    const Landmark& landmark = memory.landmarks[index];
    const Pose& previous_from_anchor = memory.anchor(landmark.anchor_id).latest_from_anchor;
    const auto before = project_anchored(images.geometry, point_of(landmark), previous_from_anchor);
    const auto after =
        project_anchored(images.geometry, point_of(landmark), current_from_previous * previous_from_anchor);
    if (!before || !after) return std::nullopt;
    const Eigen::Matrix2d warp =
        warp_of(*after, landmark.slant).pixels * warp_of(*before, landmark.slant).pixels.inverse();
    if (!warp.allFinite()) return std::nullopt;
    const auto found =
        find_in_pyramid(latest, current, landmark.pixel, warp, after->measured.head<2>(), options_.min_correlation);
    if (!found) return std::nullopt;
    return correlate(memory, index, images, current_from_previous, *found);
  });
}

std::vector<LandmarkMatch> LandmarkMatcher::by_correlation(const LandmarkMemory& memory, const StereoImages& images,
                                                           const Pose& current_from_previous) {
  return collect(memory.landmarks.size(),
                 [&](std::size_t index) { return correlate(memory, index, images, current_from_previous); });
}

std::vector<LandmarkMatch> keep_rigid(const RectifiedStereo& stereo, std::vector<LandmarkMatch> matches, int partners) {
  const std::size_t count = matches.size();
  if (count < kMinRigidMatches) return matches;
  struct Point {
    Eigen::Vector3d previous, current;
    double sigma_m = -1;  // standard deviation of the change of range; negative: too distant to be compared
  };
  std::vector<Point> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    const LandmarkMatch& m = matches[i];
    if (m.point.disparity < kRigidityDisparity_px || m.measured.z() < kRigidityDisparity_px) continue;
    Point& p = points[i];
    p.previous = stereo.triangulate(m.point.pixel.x(), m.point.pixel.y(), m.point.disparity);
    p.previous = m.previous_from_anchor * p.previous;
    p.current = stereo.triangulate(m.measured.x(), m.measured.y(), m.measured.z());
    const double variance = std::max(m.disparity_variance, kMinRigidityVariance_px2) +
                            std::max(m.covariance(2, 2), kMinRigidityVariance_px2);
    p.sigma_m = p.current.norm() / m.measured.z() * std::sqrt(variance);
  }
  const std::size_t stride = std::max<std::size_t>(1, count / static_cast<std::size_t>(partners));
  std::vector<LandmarkMatch> kept;
  for (std::size_t i = 0; i < count; ++i) {
    int compared = 0, changed = 0;
    for (std::size_t k = 1; k * stride < count && points[i].sigma_m >= 0; ++k) {
      const Point& other = points[(i + k * stride) % count];
      if (other.sigma_m < 0) continue;
      const double change =
          std::abs((points[i].previous - other.previous).norm() - (points[i].current - other.current).norm());
      ++compared;
      if (change > kRigiditySigmas * std::hypot(points[i].sigma_m, other.sigma_m)) ++changed;
    }
    if (2 * changed <= compared) kept.push_back(matches[i]);
  }
  return kept;
}

}  // namespace spartan::internal
