#include "spartan/report/internal/ground_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "spartan/core/pose.h"
#include "spartan/rig_design/rig_designer.h"

namespace spartan::internal {
namespace {

// Ahead is up, left is left.
struct Plan {
  Scale at;
  Point operator()(const Point& ground) const { return at(-ground.y(), ground.x()); }
  Points operator()(const GroundPolygon& polygon) const {
    Points points;
    points.reserve(polygon.size());
    for (const Point& corner : polygon) points.push_back((*this)(corner));
    return points;
  }
  Point polar(double radius_m, double azimuth_deg) const {
    const double a = azimuth_deg * kRadiansPerDegree;
    return (*this)(Point(radius_m * std::cos(a), radius_m * std::sin(a)));
  }
  Points arc(double radius_m, double from_deg, double to_deg) const {
    Points points;
    const int steps = std::max(2, static_cast<int>(std::ceil(std::abs(to_deg - from_deg))));
    points.reserve(static_cast<std::size_t>(steps) + 1);
    for (int i = 0; i <= steps; ++i) points.push_back(polar(radius_m, from_deg + (to_deg - from_deg) * i / steps));
    return points;
  }
};

// The views of one pair at its pans, or ahead only.
struct Views {
  std::vector<GroundPolygon> one_camera, both_cameras, twice;
};

Views views_of(const DrawnPair& pair) {
  const GroundView view = pair.view();
  std::vector<double> pans_deg{0};
  if (pair.requirements.pans) pans_deg = pair.requirements.pans->angles_deg;
  Views views;
  for (const double pan_deg : pans_deg) {
    const double pan_rad = pan_deg * kRadiansPerDegree;
    for (const double side : {0.5, -0.5}) views.one_camera.push_back(footprint(view, side * view.baseline_m, pan_rad));
    views.both_cameras.push_back(common_footprint(view, pan_rad));
  }
  for (std::size_t i = 0; i < views.both_cameras.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const GroundPolygon shared = intersection(views.both_cameras[j], views.both_cameras[i]);
      if (!shared.empty()) views.twice.push_back(shared);
    }
  }
  return views;
}

void draw_views(Drawing& drawing, const Plan& plan, const Views& views) {
  for (const GroundPolygon& polygon : views.one_camera) drawing.fill(plan(polygon), {kFirstPairOneCamera});
  for (const GroundPolygon& polygon : views.both_cameras) drawing.fill(plan(polygon), {kFirstPairBoth});
  for (const GroundPolygon& polygon : views.twice) drawing.fill(plan(polygon), {kFirstPairTwice});
  for (const GroundPolygon& polygon : views.both_cameras) drawing.line(closed(plan(polygon)), {kFirstPair, 1.2});
}

void draw_rings(Drawing& drawing, const Plan& plan, double radius_m, double half_deg) {
  for (const double r : marks(plan.at.px_per_m, radius_m)) {
    if (!(r > 0)) continue;
    drawing.line(plan.arc(r, -half_deg, half_deg), {kFaint, 0.8, 3});
    drawing.text(plan.polar(r, -half_deg) + Point(8, 14), fmt::format("{:.3g} m", r), {kInk, 13, Anchor::start, true});
  }
}

struct Extent {
  Point low{0, 0}, high{0, 0};
  void add(const GroundPolygon& polygon) {
    for (const Point& corner : polygon) {
      low = low.cwiseMin(corner);
      high = high.cwiseMax(corner);
    }
  }
};

double farthest_corner_m(const std::vector<GroundPolygon>& polygons) {
  double radius = 0;
  for (const GroundPolygon& polygon : polygons) {
    for (const Point& corner : polygon) radius = std::max(radius, corner.norm());
  }
  return radius;
}

// A line of the plan and what it means.
struct Meaning {
  Pen pen;
  std::string text;
};

constexpr Pen kRequiredPen{kInk, 1.8}, kOneCameraPen{kFirstPair, 1.8, 5}, kBothCamerasPen{kFirstPair, 1.8},
    kHeldPen{kInk, 3};
constexpr double kArcs_px = 92;  // distance of the azimuth arcs from the ground
constexpr double kMeanings_px = 44;

std::vector<Meaning> meanings_of(const PanRequirements& required, const PanCoverage& seen) {
  const auto& held = seen.full_coverage;
  return {{kRequiredPen, fmt::format("required: {}°", required.azimuth_deg)},
          {kOneCameraPen, fmt::format("far edge, one camera: {:.1f}°", seen.azimuth_far.width_deg())},
          {kBothCamerasPen, fmt::format("far edge, both cameras: {:.1f}°", seen.azimuth_far_stereo.width_deg())},
          {held ? kHeldPen : Pen{kInk, 0},
           held ? fmt::format("both cameras see all {}°: {:.2f} to {:.2f} m", required.azimuth_deg, held->from_m,
                              held->to_m)
                : fmt::format("both cameras see all {}° at no distance", required.azimuth_deg)}};
}

void draw_meanings(Drawing& drawing, double top_px, const std::vector<Meaning>& meanings) {
  double y = top_px;
  for (const Meaning& meaning : meanings) {
    if (meaning.pen.width_px > 0) drawing.line({{kMargin_px, y - 5}, {kMargin_px + 28, y - 5}}, meaning.pen);
    drawing.text({kMargin_px + 38, y}, meaning.text, {meaning.pen.colour, 14});
    y += 20;
  }
}

// An arc over each sector, with ends where it ends: not where it goes on behind the back.
void draw_sectors(Drawing& drawing, const Plan& plan, double radius_m, const AzimuthSet& azimuths, const Pen& pen) {
  const double tick = 6 / plan.at.px_per_m;
  for (const AzimuthSector& sector : azimuths.sectors()) {
    drawing.line(plan.arc(radius_m, sector.from_deg, sector.to_deg), pen);
    for (const double end : {sector.from_deg, sector.to_deg}) {
      if (std::abs(end) >= 180) continue;
      drawing.line({plan.polar(radius_m - tick, end), plan.polar(radius_m + tick, end)}, {pen.colour, pen.width_px});
    }
  }
}

void draw_azimuths(Drawing& drawing, const Plan& plan, double radius_m, const PanRequirements& required,
                   const PanCoverage& seen) {
  const AzimuthSet azimuth = required_azimuth(required);
  const double half = required.azimuth_deg / 2, gap = 26 / plan.at.px_per_m;
  for (const double end : {-half, half}) {
    if (half < 180) drawing.line({plan.polar(0, 0), plan.polar(radius_m + 3.4 * gap, end)}, {kInk, 1.2, 7});
  }
  draw_sectors(drawing, plan, radius_m + gap, seen.azimuth_far_stereo, kBothCamerasPen);
  draw_sectors(drawing, plan, radius_m + 2 * gap, seen.azimuth_far, kOneCameraPen);
  draw_sectors(drawing, plan, radius_m + 3 * gap, azimuth, kRequiredPen);
  if (!seen.full_coverage) return;
  const DistanceSpan& held = *seen.full_coverage;
  for (const double border_m : {held.from_m, held.to_m}) {
    if (border_m > 0) drawing.line(plan.arc(border_m, -half, half), kHeldPen);
  }
  drawing.text(plan.polar(held.to_m, half) + Point(-10, 5), fmt::format("{:.2f} m", held.to_m),
               {kInk, 14, Anchor::end, true});
}

// The angle of each pan, where there is room for it.
void name_pans(Drawing& drawing, const Plan& plan, double radius_m, const std::vector<double>& pans_deg) {
  constexpr double kRoom_px = 70;
  Points named;
  named.reserve(pans_deg.size());
  for (const double pan : pans_deg) {
    const Point foot = plan.polar(radius_m, pan);
    if (std::any_of(named.begin(), named.end(), [&](const Point& n) { return (n - foot).norm() < kRoom_px; })) continue;
    named.push_back(foot);
    drawing.text(foot, fmt::format("pan {}°", pan), {kInk, 15, Anchor::middle, true});
  }
}

// Extent of the plan in metres, and its scale.
struct PlanLayout {
  Plan plan;
  double radius_m, half_deg;
  double lower_end_px;
};

PlanLayout lay_out_plan(double top_px, const DrawnPair& wide, const Views& views) {
  constexpr double kTallest_px = 700;
  const bool pans = wide.requirements.pans.has_value();
  const double radius = std::max(farthest_corner_m(views.both_cameras), wide.requirements.range_m);
  const double half_deg = (pans ? wide.requirements.pans->azimuth_deg : wide.figures.parameters.hfov_deg) / 2;
  const double outside_px = pans ? kArcs_px : 0;

  Extent extent;
  for (const GroundPolygon& polygon : views.one_camera) extent.add(polygon);
  GroundPolygon arc;
  for (double a = -half_deg; a <= half_deg; a += 1) {
    arc.emplace_back(radius * std::cos(a * kRadiansPerDegree), radius * std::sin(a * kRadiansPerDegree));
  }
  extent.add(arc);
  const double aside = std::max(extent.high.y(), -extent.low.y());
  const double outside_aside_px = outside_px * std::sin(std::min(half_deg, 90.0) * kRadiansPerDegree);
  const double scale =
      std::min((kWidth_px / 2.0 - 20 - outside_aside_px) / aside, kTallest_px / (extent.high.x() - extent.low.x()));
  const double below_px = std::max(34.0, -outside_px * std::cos(half_deg * kRadiansPerDegree));
  const double origin_px = top_px + 20 + (pans ? kMeanings_px : 0) + outside_px + scale * extent.high.x();
  return {{{{kWidth_px / 2.0, origin_px}, scale}}, radius, half_deg, origin_px - scale * extent.low.x() + below_px};
}

}  // namespace

double draw_plan(Drawing& drawing, double top_px, const std::vector<DrawnPair>& pairs,
                 const std::optional<PanCoverage>& pans) {
  const DrawnPair& wide = pairs.front();
  const Views views = views_of(wide);
  const PlanLayout layout = lay_out_plan(top_px, wide, views);
  const Plan& plan = layout.plan;

  if (pans) {
    Points asked_for = plan.arc(wide.requirements.range_m, -layout.half_deg, layout.half_deg);
    asked_for.push_back(plan.polar(0, 0));
    drawing.fill(asked_for, {kUnseen});
  }
  draw_views(drawing, plan, views);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    const GroundPolygon seen = common_footprint(pairs[i].view(), 0);
    drawing.fill(plan(seen), {pairs[i].colour, 0.45});
    drawing.line(closed(plan(seen)), {pairs[i].colour, 1.5});
  }
  draw_rings(drawing, plan, layout.radius_m, layout.half_deg);
  if (pans) {
    draw_azimuths(drawing, plan, layout.radius_m, *wide.requirements.pans, *pans);
    name_pans(drawing, plan, 0.85 * wide.figures.view_far_m, wide.requirements.pans->angles_deg);
    draw_meanings(drawing, top_px + 20, meanings_of(*wide.requirements.pans, *pans));
  }
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    drawing.text(plan.polar(0.85 * pairs[i].figures.view_far_m, 0), pairs[i].name + " pair",
                 {kInk, 15, Anchor::middle, true});
  }
  const Point rover = plan.polar(0, 0);
  if (wide.figures.view_near_m > 0) {
    drawing.text(rover + Point(18, 14), "blind before the rover", {kInk, 14, Anchor::start, true});
  }
  drawing.fill({rover + Point(-7, 7), rover + Point(7, 7), rover + Point(0, -8)}, {kInk});
  return layout.lower_end_px;
}

}  // namespace spartan::internal
