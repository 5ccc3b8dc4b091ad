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

/// A match without its measurement.
LandmarkMatch match_of(const LandmarkMemory& memory, std::size_t index) {
  const Landmark& landmark = memory.landmarks[index];
  LandmarkMatch match;
  match.landmark = index;
  match.established = is_established(landmark);
  match.point = point_of(landmark);
  match.disparity_variance = landmark.variance;
  match.previous_from_anchor = memory.anchor(landmark.anchor_id).latest_from_anchor;
  return match;
}

/// Where a point is in the image of a camera, and how its surroundings are deformed from the left image of the anchor.
struct PlaceInImage {
  Eigen::Vector2d position;
  Eigen::Matrix2d warp;
  Eigen::Vector2d slant;  // of the disparity in the left image
};

/// With u_right = u − d the right image is deformed by I − e₁ slantᵀ more than the left one.
PlaceInImage place_in(ImageSide side, const AnchoredProjection& projection, const Eigen::Vector2d& slant) {
  const AnchoredWarp warp = warp_of(projection, slant);
  PlaceInImage place{projection.measured.head<2>(), warp.pixels, warp.slant};
  if (side == ImageSide::left) return place;
  place.position.x() -= projection.measured.z();
  place.warp.row(0) -= warp.slant.transpose() * warp.pixels;
  return place;
}

/// Landmarks whose disparity was not found are often half occluded or on a depth edge: they are used only where most
/// landmarks are of that kind, because the other image is dark or missing.
void prefer_both_cameras(std::vector<LandmarkMatch>& matches) {
  const auto in_one = [](const LandmarkMatch& m) { return m.cameras != MeasuredIn::both; };
  const auto count = static_cast<std::size_t>(std::count_if(matches.begin(), matches.end(), in_one));
  if (2 * count <= matches.size()) std::erase_if(matches, in_one);
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
    LandmarkMatch match = match_of(memory, i);
    match.measured = {f.feature.x, f.feature.y, f.stereo->disparity};
    match.covariance = kFeatureSigma_px * kFeatureSigma_px * Eigen::Matrix3d::Identity();
    matches.push_back(match);
  }
  return matches;
}

std::optional<LandmarkMatch> LandmarkMatcher::correlate(const LandmarkMemory& memory, std::size_t index,
                                                        const StereoImages& images, const Pose& current_from_previous,
                                                        ImageSide side,
                                                        const std::optional<Eigen::Vector2d>& start_px) const {
  const Landmark& landmark = memory.landmarks[index];
  LandmarkMatch match = match_of(memory, index);
  const auto predicted =
      project_anchored(images.geometry, match.point, current_from_previous * match.previous_from_anchor);
  if (!predicted) return std::nullopt;
  const PlaceInImage place = place_in(side, *predicted, landmark.slant);
  if (!place.warp.allFinite() || !place.slant.allFinite()) return std::nullopt;

  const bool left = side == ImageSide::left;
  const AlignmentTemplate reference(landmark.patch);
  const auto found = align_translation(reference, left ? images.left_smooth : images.right_smooth, place.warp,
                                       start_px.value_or(place.position), options_.correlation_radius_px);
  if (!found || found->correlation < options_.min_correlation) return std::nullopt;
  const int x = static_cast<int>(std::lround(found->position.x())),
            y = static_cast<int>(std::lround(found->position.y()));
  const ImageView<const std::uint8_t> mask = left ? images.left_mask : images.right_mask;
  if (!mask.empty() && mask(x, y) == 0) return std::nullopt;

  RowAlignment start;
  start.disparity = predicted->measured.z();
  start.slant = place.slant;
  std::optional<RowAlignment> stereo;
  if (left) stereo = reconstruction_.refine(images, found->position, start, options_.disparity_radius_px);
  if (stereo) {
    match.set_measured(found->position, found->covariance, stereo->disparity, stereo->sigma_px);
  } else {
    match.set_measured_in_one(left ? MeasuredIn::left : MeasuredIn::right, found->position, found->covariance,
                              predicted->measured.z());
  }
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
  prefer_both_cameras(matches);
  return matches;
}

std::vector<LandmarkMatch> LandmarkMatcher::by_pyramid(const LandmarkMemory& memory, const StereoImages& images,
                                                       const ImagePyramid& latest, const ImagePyramid& current,
                                                       const Pose& current_from_previous, ImageSide side,
                                                       WhichLandmarks which) {
  std::vector<std::size_t> candidates;
  candidates.reserve(memory.landmarks.size());
  for (std::size_t i = 0; i < memory.landmarks.size(); ++i)
    if (which == WhichLandmarks::all || is_established(memory.landmarks[i])) candidates.push_back(i);
  const std::size_t count = std::min(candidates.size(), kPyramidLandmarks);
  return collect(count, [&](std::size_t k) -> std::optional<LandmarkMatch> {
    const std::size_t index = candidates[k * candidates.size() / count];
    const Landmark& landmark = memory.landmarks[index];
    const Pose& previous_from_anchor = memory.anchor(landmark.anchor_id).latest_from_anchor;
    const auto before = project_anchored(images.geometry, point_of(landmark), previous_from_anchor);
    const auto after =
        project_anchored(images.geometry, point_of(landmark), current_from_previous * previous_from_anchor);
    if (!before || !after) return std::nullopt;
    const PlaceInImage place = place_in(side, *after, landmark.slant);
    const Eigen::Matrix2d warp = place.warp * warp_of(*before, landmark.slant).pixels.inverse();
    if (!warp.allFinite()) return std::nullopt;
    const auto found = find_in_pyramid(latest, current, landmark.pixel, warp, place.position, options_.min_correlation);
    if (!found) return std::nullopt;
    return correlate(memory, index, images, current_from_previous, side, *found);
  });
}

std::vector<LandmarkMatch> LandmarkMatcher::by_correlation(const LandmarkMemory& memory, const StereoImages& images,
                                                           const Pose& current_from_previous, ImageSide side,
                                                           WhichLandmarks which) {
  return collect(memory.landmarks.size(), [&](std::size_t index) -> std::optional<LandmarkMatch> {
    if (which == WhichLandmarks::established && !is_established(memory.landmarks[index])) return std::nullopt;
    return correlate(memory, index, images, current_from_previous, side);
  });
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
    if (m.cameras != MeasuredIn::both || m.point.disparity < kRigidityDisparity_px ||
        m.measured.z() < kRigidityDisparity_px)
      continue;
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
