#include <algorithm>
#include <cmath>

#include "spartan/reconstruction/disparity_merger.h"

namespace spartan {
namespace {

constexpr double kSteepest =
    3;  // largest slope of a cylinder: the ground at a third of the camera's height ahead of it

double elevation_of(PanoramicCamera::Projection projection, const Eigen::Vector3d& d) {
  const double level = std::hypot(d.x(), d.y());
  return projection == PanoramicCamera::Projection::cylinder ? d.z() / level : std::atan2(d.z(), level);
}

}  // namespace

PanoramicCamera::PanoramicCamera(Projection projection, ImageSize size, double per_radian, double left_rad, double top)
    : projection_(projection), size_(size), per_radian_(per_radian), left_rad_(left_rad), top_(top) {}

std::optional<Eigen::Vector2d> PanoramicCamera::project(const Eigen::Vector3d& direction) const {
  if (std::hypot(direction.x(), direction.y()) <= 1e-9 * std::abs(direction.z())) return std::nullopt;
  const double azimuth = std::atan2(direction.y(), direction.x());
  return Eigen::Vector2d(per_radian_ * (left_rad_ - azimuth),
                         per_radian_ * (top_ - elevation_of(projection_, direction)));
}

Eigen::Vector3d PanoramicCamera::direction(double u, double v) const {
  const double azimuth = left_rad_ - u / per_radian_, up = top_ - v / per_radian_;
  const double level = projection_ == Projection::cylinder ? 1 / std::hypot(1.0, up) : std::cos(up);
  const double z = projection_ == Projection::cylinder ? up * level : std::sin(up);
  return {level * std::cos(azimuth), level * std::sin(azimuth), z};
}

namespace {

// Azimuths (growing to the left) and elevations of the border of a view at two depths.
struct AngularBounds {
  double left = -10, right = 10, top = -1e9, bottom = 1e9;

  void add(PanoramicCamera::Projection projection, const Pose& body_from_centre, const ViewGeometry& view,
           double nearest_m, double farthest_m) {
    constexpr int kSteps = 16;
    const Pose centre_from_left = body_from_centre.inverse() * view.body_from_left;
    const auto [w, h] = view.stereo.size;
    for (int j = 0; j <= kSteps; ++j) {
      for (int i = 0; i <= kSteps; ++i) {
        if (i != 0 && j != 0 && i != kSteps && j != kSteps) continue;
        for (const double depth : {nearest_m, farthest_m}) {
          const double d = view.stereo.focal_px * view.stereo.baseline_m / depth;
          const Eigen::Vector3d p =
              centre_from_left * view.stereo.triangulate(i * (w - 1.0) / kSteps, j * (h - 1.0) / kSteps, d);
          const double azimuth = std::atan2(p.y(), p.x()), up = elevation_of(projection, p);
          left = std::max(left, azimuth);
          right = std::min(right, azimuth);
          top = std::max(top, up);
          bottom = std::min(bottom, up);
        }
      }
    }
    if (projection == PanoramicCamera::Projection::cylinder) {
      bottom = std::max(bottom, -kSteepest);
      top = std::min(top, kSteepest);
    }
  }
};

}  // namespace

PanoramaWindow window_of(const PanoramicCamera& camera, const Pose& body_from_centre, const ViewGeometry& view,
                         double nearest_m, double farthest_m) {
  AngularBounds bounds;
  bounds.add(camera.projection(), body_from_centre, view, nearest_m, farthest_m);
  const auto column = [&](double azimuth) { return camera.per_radian() * (camera.left_rad() - azimuth); };
  const auto row = [&](double up) { return camera.per_radian() * (camera.top() - up); };
  // The border is sampled: a part of the window is added on each side.
  const auto clamped = [](double from, double to, int size) {
    const double margin = 2 + 0.05 * (to - from);
    return std::pair(std::clamp(static_cast<int>(std::floor(from - margin)), 0, size),
                     std::clamp(static_cast<int>(std::ceil(to + margin)) + 1, 0, size));
  };
  const auto [left, right] = clamped(column(bounds.left), column(bounds.right), camera.size().width);
  const auto [top, bottom] = clamped(row(bounds.top), row(bounds.bottom), camera.size().height);
  return {left, top, {right - left, bottom - top}};
}

PanoramicCamera plan_panorama(PanoramicCamera::Projection projection, double per_radian, const Pose& body_from_centre,
                              std::span<const ViewGeometry> views, double nearest_m, double farthest_m) {
  AngularBounds bounds;
  for (const ViewGeometry& view : views) bounds.add(projection, body_from_centre, view, nearest_m, farthest_m);
  const ImageSize size{static_cast<int>(std::ceil((bounds.left - bounds.right) * per_radian)) + 1,
                       static_cast<int>(std::ceil((bounds.top - bounds.bottom) * per_radian)) + 1};
  return {projection, size, per_radian, bounds.left, bounds.top};
}

}  // namespace spartan
