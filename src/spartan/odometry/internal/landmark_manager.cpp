#include "spartan/odometry/internal/landmark_manager.h"

#include <Eigen/Dense>
#include <cmath>

#include "spartan/odometry/internal/detection/feature_spread.h"

namespace spartan::internal {
namespace {

/// A landmark is removed after so many consecutive frames without an inlier measurement; empirical.
constexpr int kMaxMissedFrames = 2;
/// Lower bound of a disparity's standard deviation: errors of viewpoint and calibration that all measurements share do
/// not average out. Empirical.
constexpr double kMinDisparitySigma_px = 0.03;
/// A feature within this distance of a landmark shows the same point; empirical.
constexpr double kSamePoint_px = 2.0;

/// Re-anchors a landmark in the current frame with the patch around the nearest whole pixel. False where the patch
/// leaves the image.
bool anchor_here(Landmark& landmark, std::uint32_t anchor_id, const StereoImages& images, const RowAlignment& stereo) {
  const Eigen::Vector2d pixel(std::round(landmark.pixel.x()), std::round(landmark.pixel.y()));
  const auto patch = cut_patch(images.left_smooth, static_cast<int>(pixel.x()), static_cast<int>(pixel.y()));
  if (!patch) return false;
  landmark.anchor_id = anchor_id;
  landmark.anchor_pixel = pixel;
  landmark.disparity = stereo.disparity + stereo.slant.dot(pixel - landmark.pixel);
  landmark.variance = stereo.sigma_px * stereo.sigma_px;
  landmark.slant = stereo.slant;
  landmark.patch = *patch;
  landmark.pixel = pixel;
  return true;
}

/// The appearance of a landmark changes as the rover approaches it, so the descriptor follows.
void refresh_descriptor(Landmark& landmark, const Feature& feature) {
  if (std::hypot(feature.x - landmark.pixel.x(), feature.y - landmark.pixel.y()) > kSamePoint_px) return;
  landmark.scale = feature.scale;
  landmark.angle = feature.angle;
  landmark.descriptor = feature.descriptor;
}

}  // namespace

void discard(Landmark& landmark) {
  landmark.missed_frames = kMaxMissedFrames;
}

void move_anchors(LandmarkMemory& memory, const Pose& previous_from_current) {
  const Pose current_from_previous = previous_from_current.inverse();
  for (Anchor& anchor : memory.anchors) anchor.latest_from_anchor = current_from_previous * anchor.latest_from_anchor;
}

void LandmarkManager::update(LandmarkMemory& memory, const StereoImages& images,
                             const std::vector<LandmarkMatch>& matches, const MotionFit& fit, bool establishes,
                             const std::vector<ReconstructedFeature>& features,
                             const std::vector<int>& feature_of) const {
  const double noise = fit.noise_scale * fit.noise_scale, max_scale = options_.matching.max_scale_change;
  const Eigen::Vector3d offset(0, 0, fit.offset.value);
  for (Landmark& landmark : memory.landmarks) ++landmark.missed_frames;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!fit.inlier[i]) continue;
    const LandmarkMatch& match = matches[i];
    Landmark& landmark = memory.landmarks[match.landmark];
    const AnchoredPoint point{match.point.pixel, match.point.disparity + fit.offset.value};
    const auto p = project_anchored(images.geometry, point, memory.anchor(landmark.anchor_id).latest_from_anchor);
    if (!p) continue;
    // Scalar Kalman update in information form: H = ∂h/∂d, R = noise · covariance.
    const Eigen::Vector3d weighted = (noise * match.covariance).ldlt().solve(p->by_disparity);
    const double variance = 1 / (1 / landmark.variance + weighted.dot(p->by_disparity));
    landmark.disparity += variance * weighted.dot(match.measured + offset - p->measured);
    landmark.variance = std::max(variance, kMinDisparitySigma_px * kMinDisparitySigma_px);
    landmark.pixel = match.measured.head<2>();
    landmark.missed_frames = 0;
    if (establishes) ++landmark.measured_frames;
    const int feature = feature_of.empty() ? -1 : feature_of[match.landmark];
    if (feature >= 0) refresh_descriptor(landmark, features[static_cast<std::size_t>(feature)].feature);

    const AnchoredWarp warp = warp_of(*p, landmark.slant);
    const double scale = std::sqrt(std::abs(warp.pixels.determinant()));
    if (match.cameras != MeasuredIn::both || (scale < max_scale && scale * max_scale > 1)) continue;
    const double sigma = std::sqrt(landmark.variance) * std::abs(p->by_disparity.z());
    const RowAlignment stereo{p->measured.z() - fit.offset.value, warp.slant, std::max(sigma, kMinDisparitySigma_px),
                              1};
    if (!anchor_here(landmark, memory.next_anchor_id, images, stereo)) landmark.missed_frames = kMaxMissedFrames;
  }
  std::erase_if(memory.landmarks, [](const Landmark& l) { return l.missed_frames >= kMaxMissedFrames; });
}

void LandmarkManager::add(LandmarkMemory& memory, const StereoImages& images,
                          const std::vector<ReconstructedFeature>& features) const {
  std::vector<Landmark>& landmarks = memory.landmarks;
  Occupancy occupancy(images.left.size(), options_.detection.spacing_px);
  for (const Landmark& landmark : landmarks) occupancy.take(landmark.pixel.x(), landmark.pixel.y());
  for (const ReconstructedFeature& f : features) {
    if (static_cast<int>(landmarks.size()) >= options_.detection.landmarks) break;
    if (!f.stereo || !occupancy.is_free(f.feature.x, f.feature.y)) continue;
    Landmark landmark;
    // The disparity was measured at the whole pixel.
    landmark.pixel = {std::round(f.feature.x), std::round(f.feature.y)};
    RowAlignment stereo = *f.stereo;
    stereo.sigma_px = std::hypot(stereo.sigma_px, options_.motion.disparity_sigma_px);
    if (!anchor_here(landmark, memory.next_anchor_id, images, stereo)) continue;
    landmark.scale = f.feature.scale;
    landmark.angle = f.feature.angle;
    landmark.sign = f.feature.sign;
    landmark.descriptor = f.feature.descriptor;
    occupancy.take(f.feature.x, f.feature.y);
    landmarks.push_back(landmark);
  }
  memory.anchors.push_back({memory.next_anchor_id++, Pose()});
  memory.drop_unused_anchors();
}

}  // namespace spartan::internal
