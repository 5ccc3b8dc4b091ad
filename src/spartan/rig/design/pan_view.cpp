#include "spartan/rig/design/pan_view.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "spartan/rig/design/stereo_relations.h"

namespace spartan {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;
// Between distances at which the shape of a footprint's azimuths changes, it is looked at in so many places.
constexpr int kLooks = 64;

// Where an arc around the origin meets a corner of the polygon or first touches a side, rising, from 0 to beyond it.
std::vector<double> turning_points_m(const GroundPolygon& polygon) {
  std::vector<double> distances{0};
  distances.reserve(2 * polygon.size() + 2);
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const Eigen::Vector2d along = b - a;
    const double part = along.squaredNorm() > 0 ? std::clamp(-a.dot(along) / along.squaredNorm(), 0.0, 1.0) : 0;
    distances.push_back(a.norm());
    distances.push_back((a + part * along).norm());
  }
  std::sort(distances.begin(), distances.end());
  distances.push_back(1.001 * distances.back());
  return distances;
}

std::vector<double> places_to_look_m(const GroundPolygon& polygon) {
  const std::vector<double> turning = turning_points_m(polygon);
  std::vector<double> places{0};
  places.reserve(kLooks * turning.size());
  for (std::size_t i = 1; i < turning.size(); ++i) {
    const double step = (turning[i] - turning[i - 1]) / kLooks;
    for (int k = 0; k < kLooks && step > 0; ++k) places.push_back(turning[i - 1] + (k + 0.5) * step);
  }
  return places;
}

// Where all of the asked azimuth is seen. A ring is found that is wider than the looks are apart; its borders are
// exact.
std::optional<DistanceSpan> longest_held(const GroundPolygon& polygon, const PanRequirements& pans) {
  const AzimuthSet asked = asked_azimuth(pans);
  const auto sees_all = [&](double distance_m) { return seen_azimuth(polygon, pans, distance_m).covers(asked); };
  const auto border_m = [&](double unseen_m, double seen_m) {
    for (int halvings = 0; halvings < 60; ++halvings) {
      const double middle = (unseen_m + seen_m) / 2;
      (sees_all(middle) ? seen_m : unseen_m) = middle;
    }
    return seen_m;
  };
  std::optional<DistanceSpan> longest;
  const std::vector<double> places = places_to_look_m(polygon);
  DistanceSpan span;
  bool inside = false;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const bool seen = sees_all(places[i]);
    if (seen && !inside) span.from_m = i == 0 ? 0 : border_m(places[i - 1], places[i]);
    if (!seen && inside) {
      span.to_m = border_m(places[i], places[i - 1]);
      if (!longest || span.to_m - span.from_m > longest->to_m - longest->from_m) longest = span;
    }
    inside = seen;
  }
  return longest;
}

}  // namespace

double PanOverlap::percent() const {
  return overlap_percent(view_rad, step_rad);
}

double PanOverlap::gap_deg() const {
  return (step_rad - view_rad) / kRadiansPerDegree;
}

AzimuthSet asked_azimuth(const PanRequirements& pans) {
  return AzimuthSet::around(0, pans.azimuth_deg / 2);
}

AzimuthSet seen_azimuth(const GroundPolygon& at_pan_0, const PanRequirements& pans, double distance_m) {
  return azimuths_at(at_pan_0, distance_m).turned_by(pans.angles_deg).within(asked_azimuth(pans));
}

PanFigures pan_figures(const GroundView& view, const PanRequirements& pans) {
  const GroundPolygon common = common_footprint(view, 0);
  const auto one_eye = far_half_azimuth_rad(footprint(view, 0, 0)), both_eyes = far_half_azimuth_rad(common);
  const double step_rad = pans.widest_step_deg() * kRadiansPerDegree;
  const auto overlap = [&](double view_rad) -> std::optional<PanOverlap> {
    if (pans.angles_deg.size() < 2) return std::nullopt;
    return PanOverlap{view_rad, step_rad};
  };
  const auto far_azimuth = [&](std::optional<double> half_rad) {
    const AzimuthSet of_a_pan = AzimuthSet::around(0, half_rad.value_or(0) / kRadiansPerDegree);
    return of_a_pan.turned_by(pans.angles_deg).within(asked_azimuth(pans));
  };

  PanFigures figures;
  figures.overlap = overlap(view.hfov_rad);
  if (one_eye) figures.far_overlap = overlap(2 * *one_eye);
  if (both_eyes) figures.far_overlap_stereo = overlap(2 * *both_eyes);
  figures.azimuth_far = far_azimuth(one_eye);
  figures.azimuth_far_stereo = far_azimuth(both_eyes);
  figures.azimuth_held = longest_held(common, pans);
  return figures;
}

}  // namespace spartan
