#include <algorithm>
#include <cmath>

#include "spartan/core/pose.h"
#include "spartan/rig_design/internal/stereo_relations.h"
#include "spartan/rig_design/rig_designer.h"

namespace spartan {

using namespace internal;

namespace {

// Samples between two critical distances: the resolution with which full coverage is searched (empirical).
constexpr int kSamplesPerInterval = 64;

// Radii at which a circle around the origin passes a corner of the polygon or touches a side, ascending, from 0 to
// beyond the polygon. Between them the covered azimuths change continuously.
std::vector<double> critical_distances_m(const GroundPolygon& polygon) {
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

std::vector<double> sample_distances_m(const GroundPolygon& polygon) {
  const std::vector<double> critical = critical_distances_m(polygon);
  std::vector<double> samples{0};
  samples.reserve(kSamplesPerInterval * critical.size());
  for (std::size_t i = 1; i < critical.size(); ++i) {
    const double step = (critical[i] - critical[i - 1]) / kSamplesPerInterval;
    for (int k = 0; k < kSamplesPerInterval && step > 0; ++k) samples.push_back(critical[i - 1] + (k + 0.5) * step);
  }
  return samples;
}

// The longest range of distances with full coverage of the required azimuth. Ranges shorter than the sampling may be
// missed; the limits of a range are found by bisection.
std::optional<DistanceSpan> longest_full_coverage(const GroundPolygon& polygon, const PanRequirements& pans) {
  const AzimuthSet required = required_azimuth(pans);
  const auto covers_all = [&](double distance_m) {
    return covered_azimuth(polygon, pans, distance_m).covers(required);
  };
  // 60 halvings reach the resolution of a double.
  const auto limit_m = [&](double outside_m, double inside_m) {
    for (int halvings = 0; halvings < 60; ++halvings) {
      const double middle = (outside_m + inside_m) / 2;
      (covers_all(middle) ? inside_m : outside_m) = middle;
    }
    return inside_m;
  };
  std::optional<DistanceSpan> longest;
  const std::vector<double> samples = sample_distances_m(polygon);
  DistanceSpan span;
  bool inside = false;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const bool covered = covers_all(samples[i]);
    if (covered && !inside) span.from_m = i == 0 ? 0 : limit_m(samples[i - 1], samples[i]);
    if (!covered && inside) {
      span.to_m = limit_m(samples[i], samples[i - 1]);
      if (!longest || span.to_m - span.from_m > longest->to_m - longest->from_m) longest = span;
    }
    inside = covered;
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

AzimuthSet required_azimuth(const PanRequirements& pans) {
  return AzimuthSet::around(0, pans.azimuth_deg / 2);
}

AzimuthSet covered_azimuth(const GroundPolygon& at_pan_0, const PanRequirements& pans, double distance_m) {
  return azimuths_at(at_pan_0, distance_m).rotated_by(pans.angles_deg).intersected_with(required_azimuth(pans));
}

PanCoverage pan_coverage(const GroundView& view, const PanRequirements& pans) {
  const GroundPolygon common = common_footprint(view, 0);
  const auto one_camera = far_edge_half_azimuth_rad(footprint(view, 0, 0)),
             both_cameras = far_edge_half_azimuth_rad(common);
  const double step_rad = pans.widest_step_deg() * kRadiansPerDegree;
  const auto overlap = [&](double view_rad) -> std::optional<PanOverlap> {
    if (pans.angles_deg.size() < 2) return std::nullopt;
    return PanOverlap{view_rad, step_rad};
  };
  const auto far_azimuth = [&](std::optional<double> half_rad) {
    const AzimuthSet of_a_pan = AzimuthSet::around(0, half_rad.value_or(0) / kRadiansPerDegree);
    return of_a_pan.rotated_by(pans.angles_deg).intersected_with(required_azimuth(pans));
  };

  PanCoverage figures;
  figures.overlap = overlap(view.hfov_rad);
  if (one_camera) figures.far_overlap = overlap(2 * *one_camera);
  if (both_cameras) figures.far_overlap_stereo = overlap(2 * *both_cameras);
  figures.azimuth_far = far_azimuth(one_camera);
  figures.azimuth_far_stereo = far_azimuth(both_cameras);
  figures.full_coverage = longest_full_coverage(common, pans);
  return figures;
}

}  // namespace spartan
