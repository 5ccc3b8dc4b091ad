#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "spartan/core/pose.h"
#include "spartan/rig_design/internal/stereo_relations.h"
#include "spartan/rig_design/rig_designer.h"

namespace spartan {

using namespace internal;

namespace {

// Twice the signed area of the triangle o, a, b; positive if counter-clockwise.
double cross(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  const Eigen::Vector2d u = a - o, v = b - o;
  return u.x() * v.y() - u.y() * v.x();
}

// The part of a polygon to the left of the line from a to b (Sutherland and Hodgman, CACM 17, 1974).
GroundPolygon left_of(const GroundPolygon& polygon, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  GroundPolygon kept;
  kept.reserve(polygon.size() + 1);
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double side_p = cross(a, b, p), side_q = cross(a, b, q);
    if (side_p >= 0) kept.push_back(p);
    if ((side_p > 0 && side_q < 0) || (side_p < 0 && side_q > 0))
      kept.push_back(p + (q - p) * side_p / (side_p - side_q));
  }
  return kept;
}

}  // namespace

bool is_below_horizon(const GroundView& view) {
  return view.tilt_rad > view.vfov_rad / 2;
}

double near_edge_m(const GroundView& view) {
  return ground_ahead_m(view.height_m, view.tilt_rad + view.vfov_rad / 2);
}

double far_edge_m(const GroundView& view) {
  return ground_ahead_m(view.height_m, view.tilt_rad - view.vfov_rad / 2);
}

GroundPolygon footprint(const GroundView& view, double camera_left_m, double pan_rad) {
  if (!is_below_horizon(view)) throw std::invalid_argument("footprint: the view reaches above the horizon");
  const double side = std::tan(view.hfov_rad / 2), rise = std::tan(view.vfov_rad / 2);
  const double c = std::cos(view.tilt_rad), s = std::sin(view.tilt_rad);
  // Intersects the camera ray (1 ahead, `left`, `up`), tilted down, with the ground.
  const auto on_ground = [&](double left, double up) {
    const double ahead = c + up * s, down = s - up * c;
    const Eigen::Vector2d point(view.height_m * ahead / down, view.height_m * left / down + camera_left_m);
    return Eigen::Vector2d(Eigen::Rotation2Dd(pan_rad) * point);
  };
  return {on_ground(-side, -rise), on_ground(-side, rise), on_ground(side, rise), on_ground(side, -rise)};
}

GroundPolygon common_footprint(const GroundView& view, double pan_rad) {
  return intersection(footprint(view, view.baseline_m / 2, pan_rad), footprint(view, -view.baseline_m / 2, pan_rad));
}

GroundPolygon intersection(const GroundPolygon& a, const GroundPolygon& b) {
  GroundPolygon common = a;
  for (std::size_t i = 0; i < b.size(); ++i) common = left_of(common, b[i], b[(i + 1) % b.size()]);
  return area_m2(common) > 0 ? common : GroundPolygon{};
}

double area_m2(const GroundPolygon& polygon) {
  double twice = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) twice += cross(polygon[0], polygon[i], polygon[i + 1]);
  return twice / 2;
}

std::optional<double> far_edge_half_azimuth_rad(const GroundPolygon& polygon) {
  if (polygon.empty()) return std::nullopt;
  double far = polygon.front().x(), half = 0;
  for (const Eigen::Vector2d& corner : polygon) far = std::max(far, corner.x());
  for (const Eigen::Vector2d& corner : polygon) {
    if (corner.x() >= far - 1e-9 * std::abs(far)) half = std::max(half, std::abs(std::atan2(corner.y(), corner.x())));
  }
  return half;
}

AzimuthSet azimuths_at(const GroundPolygon& polygon, double distance_m) {
  if (polygon.empty()) return {};
  double size = 0;
  for (const Eigen::Vector2d& corner : polygon) size = std::max(size, corner.norm());
  AzimuthSet seen = AzimuthSet::all();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const Eigen::Vector2d along = b - a;
    if (along.norm() <= 1e-12 * size) continue;  // skip duplicate corners
    // Points inside this side have at least this coordinate along its inner normal.
    const Eigen::Vector2d inward = Eigen::Vector2d(-along.y(), along.x()).normalized();
    const double least_m = inward.dot(a);
    if (least_m <= -distance_m) continue;
    if (least_m >= distance_m) return {};
    seen = seen.intersected_with(AzimuthSet::around(std::atan2(inward.y(), inward.x()) * kDegreesPerRadian,
                                                    std::acos(least_m / distance_m) * kDegreesPerRadian));
  }
  return seen;
}

}  // namespace spartan
