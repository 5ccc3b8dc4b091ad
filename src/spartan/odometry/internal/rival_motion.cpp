#include "spartan/odometry/internal/rival_motion.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

namespace spartan::internal {
namespace {

/// A first motion that deviates less than this from the prediction is that of the scene; empirical, the threshold of
/// RANSAC by default.
constexpr double kPredicted_px = 3;
/// A rival has at least this many inliers, and this fraction of those of the first motion: an object near the camera is
/// matched better than a scene that changes its scale. Empirical.
constexpr int kMinRivalInliers = 15;
constexpr double kMinRivalFraction = 0.05;
/// A rival is searched among matches that lie this near to the prediction; empirical, several times its usual error.
constexpr double kPredictionRadius_px = 12;
/// A rival that explains more than this fraction of the first motion's inliers is the same motion, less accurate.
constexpr double kMaxShared = 0.6;
/// The rival deviates from the prediction less than the first motion by this factor; empirical.
constexpr double kDeviationRatio = 2;
/// The inliers of an object are not spread over this many times the area of the scene's.
constexpr double kAreaRatio = 1.3;

/// The motion of the scene has at least this many times the established landmarks that an object has; empirical.
constexpr int kEstablishedRatio = 2;
/// Motions among the outliers of the first one that are tried as its rival: an object has several, where landmarks of
/// different age follow it.
constexpr int kMostRivals = 3;
/// Matches that two motions predict within this distance belong to both.
constexpr double kSamePlace_px = 1;

/// Median distance in pixels between the image positions by a motion and by the prediction, over the inliers of either.
double deviation_from(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                      const std::vector<bool>& used, const Pose& motion, const Pose& predicted) {
  const Pose by_motion = motion.inverse(), by_prediction = predicted.inverse();
  std::vector<double> distances;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!used[i]) continue;
    const auto a = project_anchored(stereo, matches[i].point, by_motion * matches[i].previous_from_anchor);
    const auto b = project_anchored(stereo, matches[i].point, by_prediction * matches[i].previous_from_anchor);
    // A point that only one of them has in front of the camera is as far as can be.
    if (!a && !b) continue;
    distances.push_back(a && b ? (a->measured - b->measured).head<2>().norm()
                               : std::numeric_limits<double>::infinity());
  }
  if (distances.empty()) return 0;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

/// Area over which the inliers spread in pixels²: the square root of the determinant of their covariance.
double area_of(const std::vector<LandmarkMatch>& matches, const std::vector<bool>& inlier) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!inlier[i]) continue;
    const Eigen::Vector2d at = matches[i].measured.head<2>();
    sum += at;
    squares += at * at.transpose();
    ++count;
  }
  const Eigen::Vector2d mean = sum / count;
  const Eigen::Matrix2d covariance = squares / count - mean * mean.transpose();
  return std::sqrt(std::max(0.0, covariance(0, 0) * covariance(1, 1) - covariance(0, 1) * covariance(1, 0)));
}

// Whether the motion contradicts the first one and is nearer to the prediction. Each deviation is that of a motion's
// own inliers: elsewhere a motion of few distant points may be far off.
bool is_rival(const MotionEstimator& estimator, const RectifiedStereo& stereo,
              const std::vector<LandmarkMatch>& matches, const MotionFit& first, const MotionFit& other,
              const Pose& predicted) {
  const std::vector<bool> agreeing = estimator.agreeing(stereo, matches, other.previous_from_current);
  int shared = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) shared += agreeing[i] && first.inlier[i];
  if (shared > kMaxShared * first.inliers) return false;
  const auto deviation = [&](const MotionFit& fit) {
    return deviation_from(stereo, matches, fit.inlier, fit.previous_from_current, predicted);
  };
  return kDeviationRatio * deviation(other) <= deviation(first);
}

/// Whether one motion explains both sets: coarse motions of landmarks in different parts of the view differ by more
/// than their noise.
bool is_one_motion(const MotionEstimator& estimator, const RectifiedStereo& stereo,
                   const std::vector<LandmarkMatch>& matches, const MotionFit& first,
                   const std::vector<LandmarkMatch>& others, const MotionFit& second) {
  std::vector<LandmarkMatch> both;
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (first.inlier[i]) both.push_back(matches[i]);
  for (std::size_t i = 0; i < others.size(); ++i)
    if (second.inlier[i]) both.push_back(others[i]);
  const auto fit = estimator.fine(stereo, both, second.previous_from_current);
  if (!fit) return false;
  const auto end = fit->inlier.begin() + first.inliers;
  return 2 * std::count(fit->inlier.begin(), end, true) >= first.inliers &&
         2 * std::count(end, fit->inlier.end(), true) >= second.inliers;
}

}  // namespace

bool is_as_predicted(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches, const MotionFit& motion,
                     const Pose& predicted) {
  return deviation_from(stereo, matches, motion.inlier, motion.previous_from_current, predicted) < kPredicted_px;
}

std::optional<MotionFit> find_rival(const MotionEstimator& estimator, const RectifiedStereo& stereo,
                                    const std::vector<LandmarkMatch>& matches, const MotionFit& first,
                                    const Pose& predicted) {
  const int least = std::max(kMinRivalInliers, static_cast<int>(std::ceil(kMinRivalFraction * first.inliers)));
  if (static_cast<int>(matches.size()) - first.inliers < least) return std::nullopt;
  if (is_as_predicted(stereo, matches, first, predicted)) return std::nullopt;
  std::vector<LandmarkMatch> outliers;
  std::vector<std::size_t> index;
  const Pose by_prediction = predicted.inverse();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (first.inlier[i]) continue;
    const auto p = project_anchored(stereo, matches[i].point, by_prediction * matches[i].previous_from_anchor);
    if (!p || matches[i].observed(p->measured - matches[i].measured).norm() > kPredictionRadius_px) continue;
    outliers.push_back(matches[i]);
    index.push_back(i);
  }
  for (int attempt = 0; attempt < kMostRivals; ++attempt) {
    if (static_cast<int>(outliers.size()) < least) return std::nullopt;
    std::optional<MotionFit> rival = estimator.coarse(stereo, outliers, least, predicted);
    if (!rival || rival->inliers < least) return std::nullopt;
    std::vector<bool> inlier(matches.size(), false);
    std::size_t kept = 0;
    for (std::size_t k = 0; k < index.size(); ++k) {
      inlier[index[k]] = rival->inlier[k];
      if (rival->inlier[k]) continue;
      outliers[kept] = outliers[k];
      index[kept++] = index[k];
    }
    outliers.resize(kept);
    index.resize(kept);
    rival->inlier = std::move(inlier);
    if (is_rival(estimator, stereo, matches, first, *rival, predicted)) return rival;
  }
  return std::nullopt;
}

bool is_of_young_landmarks(const std::vector<LandmarkMatch>& matches, const MotionFit& motion) {
  int established = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) established += motion.inlier[i] && matches[i].established;
  return 2 * established < motion.inliers;
}

std::optional<ChosenMotion> find_established_motion(const MotionEstimator& estimator, const RectifiedStereo& stereo,
                                                    const std::vector<LandmarkMatch>& established,
                                                    const std::vector<LandmarkMatch>& matches, const MotionFit& first,
                                                    const Pose& predicted) {
  const std::vector<bool> agreeing = estimator.agreeing(stereo, established, first.previous_from_current);
  const auto with_first = static_cast<int>(std::count(agreeing.begin(), agreeing.end(), true));
  const int least = std::max(kMinRivalInliers, kEstablishedRatio * with_first);
  std::optional<MotionFit> scene = estimator.coarse(stereo, established, least, predicted);
  if (!scene || scene->inliers < least || is_one_motion(estimator, stereo, matches, first, established, *scene))
    return std::nullopt;
  std::string reason = fmt::format("{} landmarks of several frames follow one motion, {} another, that of an object",
                                   scene->inliers, with_first);
  return ChosenMotion{*std::move(scene), first.previous_from_current, std::move(reason)};
}

ChosenMotion choose_motion(const std::vector<LandmarkMatch>& matches, const MotionFit& first, const MotionFit& rival) {
  const bool ambiguous = area_of(matches, first.inlier) > kAreaRatio * area_of(matches, rival.inlier);
  if (ambiguous) {
    return {first, std::nullopt,
            fmt::format("{} matches follow one motion, {} another, as predicted; which one is of the scene is "
                        "ambiguous",
                        first.inliers, rival.inliers)};
  }
  return {rival, first.previous_from_current,
          fmt::format("{} matches follow the predicted motion, {} that of an object", rival.inliers, first.inliers)};
}

std::vector<bool> follows_object(const RectifiedStereo& stereo, const std::vector<LandmarkMatch>& matches,
                                 const Pose& scene, const Pose& object) {
  const Pose by_scene = scene.inverse(), by_object = object.inverse();
  std::vector<bool> follows(matches.size(), false);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const LandmarkMatch& match = matches[i];
    const auto a = project_anchored(stereo, match.point, by_scene * match.previous_from_anchor);
    const auto b = project_anchored(stereo, match.point, by_object * match.previous_from_anchor);
    if (!a || !b || match.observed(a->measured - b->measured).norm() < kSamePlace_px) continue;
    follows[i] =
        match.observed(b->measured - match.measured).norm() < match.observed(a->measured - match.measured).norm();
  }
  return follows;
}

}  // namespace spartan::internal
