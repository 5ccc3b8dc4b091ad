#include "program/ground_picture.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "spartan/rig/ground_view.h"

namespace spartan::program {
namespace {

using Point = Eigen::Vector2d;
using Points = Drawing::Points;

constexpr double kRadiansPerDegree = std::numbers::pi / 180;
constexpr int kWidth_px = 1200;
constexpr double kMargin_px = 40;
constexpr double kLabels_px = 270;  // a column for words beside the side view

// Colours that people tell apart who see no red or no green (after Okabe and Ito), lighter for what fewer eyes see.
constexpr Rgb8 kInk{30, 30, 30}, kFaint{150, 150, 150}, kSoil{120, 100, 80}, kUnseen{222, 222, 222};
constexpr Rgb8 kWide{0, 114, 178}, kWideOneEye{200, 226, 243}, kWideBoth{134, 187, 222}, kWideTwice{58, 134, 188};
constexpr Rgb8 kNarrow{213, 94, 0}, kShared{0, 158, 115};

constexpr Lettering kTitle{kInk, 22}, kSmall{kFaint, 13};

// One pair as it is drawn.
struct DrawnPair {
  std::string name;
  Rgb8 colour;
  const PairRequirements& requirements;
  const PairFigures& figures;
  GroundView view() const { return ground_view(figures, requirements); }
};

// Metres of a plane into pixels: `right` and `up` of the plane's axes.
struct Scale {
  Point origin;
  double px_per_m;
  Point operator()(double right_m, double up_m) const {
    return {origin.x() + right_m * px_per_m, origin.y() - up_m * px_per_m};
  }
};

std::string metres(double value) {
  return fmt::format("{:.2f} m", value);
}

// The marks of a scale up to `to_m`: round steps that leave room for words.
std::vector<double> marks(double px_per_m, double to_m) {
  constexpr double kRoom_px = 110;
  double step = 1e-6;
  for (int i = 0; step * px_per_m < kRoom_px; ++i) step *= i % 3 == 1 ? 2.5 : 2;
  std::vector<double> places(static_cast<std::size_t>(std::max(0.0, to_m) / step) + 1);
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = static_cast<double>(i) * step;
  return places;
}

// --- from the side ---

void draw_pair_from_side(Drawing& drawing, const Scale& at, const DrawnPair& pair) {
  const double height = pair.requirements.height_m;
  const Point eye = at(0, height), near = at(pair.figures.view_near_m, 0), far = at(pair.figures.view_far_m, 0);
  drawing.fill({eye, near, far}, {pair.colour, 0.18});
  drawing.line({near, eye, far}, {pair.colour, 1.5});
  drawing.fill({eye + Point(-9, -6), eye + Point(9, -6), eye + Point(9, 6), eye + Point(-9, 6)}, {pair.colour});
  const auto label = [&](double below_px, const std::string& words) {
    drawing.text(eye + Point(-22, below_px), words, {pair.colour, 14, Anchor::end});
  };
  label(0, fmt::format("{} pair, {} m high", pair.name, height));
  label(17, fmt::format("{}° down, {:.1f}° high", pair.figures.tilt_deg, pair.figures.vfov_deg));
}

// What a pair sees as a bar below the ground: full colour up to where its resolution holds, a mark where that is asked
// for.
void draw_bar(Drawing& drawing, const Scale& at, double y_px, const DrawnPair& pair) {
  const auto bar = [&](double from_m, double to_m, double opacity) {
    if (!(from_m < to_m)) return;
    const double from = at(from_m, 0).x(), to = at(to_m, 0).x();
    drawing.fill({{from, y_px}, {to, y_px}, {to, y_px + 12}, {from, y_px + 12}}, {pair.colour, opacity});
  };
  const double near = pair.figures.view_near_m, far = pair.figures.view_far_m;
  const double held = std::clamp(pair.figures.range_m, near, far);
  bar(near, held, 0.9);
  bar(held, far, 0.3);
  const double asked = at(pair.requirements.range_m, 0).x();
  drawing.line({{asked, y_px - 3}, {asked, y_px + 15}}, {kInk, 2.5});
  drawing.text({kLabels_px - 22, y_px + 11}, fmt::format("{}: {:.3f} to {:.3f} m", pair.name, near, far),
               {pair.colour, 14, Anchor::end});
}

void draw_plain_bar(Drawing& drawing, const Scale& at, double y_px, double from_m, double to_m, const Rgb8& colour,
                    const std::string& words) {
  const double from = at(from_m, 0).x(), to = at(to_m, 0).x();
  drawing.fill({{from, y_px}, {to, y_px}, {to, y_px + 12}, {from, y_px + 12}}, {colour, 0.9});
  drawing.text({kLabels_px - 22, y_px + 11}, words, {kInk, 14, Anchor::end});
}

void draw_bars(Drawing& drawing, const Scale& at, double y_px, const std::vector<DrawnPair>& pairs,
               std::optional<double> shared_m) {
  double near = pairs.front().figures.view_near_m, from = near;
  for (const DrawnPair& pair : pairs) {
    draw_bar(drawing, at, y_px, pair);
    y_px += 24;
    near = std::min(near, pair.figures.view_near_m);
    from = std::max(from, pair.figures.view_near_m);
  }
  if (shared_m && *shared_m > 0) {
    draw_plain_bar(drawing, at, y_px, from, from + *shared_m, kShared, "both: " + metres(*shared_m));
    y_px += 24;
  }
  if (near > 0) draw_plain_bar(drawing, at, y_px, 0, near, kFaint, fmt::format("blind: up to {:.3f} m", near));
  drawing.text({at(0, 0).x(), y_px + 38}, "full colour: the asked resolution holds; black mark: asked up to here",
               kSmall);
}

// Gives the row, px, below which nothing is drawn.
double draw_side(Drawing& drawing, double top_px, const std::vector<DrawnPair>& pairs, std::optional<double> shared_m) {
  double farthest = 0, nearest = 0, highest = 0;
  for (const DrawnPair& pair : pairs) {
    farthest = std::max({farthest, pair.figures.view_far_m, pair.requirements.range_m});
    nearest = std::min(nearest, pair.figures.view_near_m);
    highest = std::max(highest, pair.requirements.height_m);
  }
  constexpr double kTallest_px = 330;
  const double scale =
      std::min((kWidth_px - kLabels_px - kMargin_px) / (1.02 * (farthest - nearest)), kTallest_px / highest);
  const double ground_px = top_px + 20 + scale * highest;
  const Scale at{{kLabels_px - nearest * scale, ground_px}, scale};

  drawing.line({at(0, 0), at(0, highest)}, {kInk, 4});
  for (const DrawnPair& pair : pairs) draw_pair_from_side(drawing, at, pair);
  drawing.line({at(std::min(nearest, -0.05), 0), at(1.02 * farthest, 0)}, {kSoil, 3});
  for (const double x : marks(scale, 1.02 * farthest)) {
    drawing.line({at(x, 0), at(x, 0) + Point(0, 8)}, {kSoil, 1.5});
    drawing.text(at(x, 0) + Point(0, 24), fmt::format("{:.3g} m", x), {kInk, 13, Anchor::middle});
  }
  draw_bars(drawing, at, ground_px + 40, pairs, shared_m);
  return ground_px + 40 + 24.0 * static_cast<double>(pairs.size() + 2) + 30;
}

// --- from above ---

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

Points closed(Points points) {
  if (!points.empty()) points.push_back(points.front());
  return points;
}

// The views of one pair at its pans, or ahead only.
struct Views {
  std::vector<GroundPolygon> one_eye, both_eyes, twice;
};

Views views_of(const DrawnPair& pair) {
  const GroundView view = pair.view();
  std::vector<double> pans_deg{0};
  if (pair.requirements.pans) pans_deg = pair.requirements.pans->angles_deg;
  Views views;
  for (const double pan_deg : pans_deg) {
    const double pan_rad = pan_deg * kRadiansPerDegree;
    for (const double side : {0.5, -0.5}) views.one_eye.push_back(footprint(view, side * view.baseline_m, pan_rad));
    views.both_eyes.push_back(common_footprint(view, pan_rad));
  }
  for (std::size_t i = 1; i < views.both_eyes.size(); ++i) {
    views.twice.push_back(intersection(views.both_eyes[i - 1], views.both_eyes[i]));
  }
  return views;
}

void draw_views(Drawing& drawing, const Plan& plan, const Views& views) {
  for (const GroundPolygon& polygon : views.one_eye) drawing.fill(plan(polygon), {kWideOneEye});
  for (const GroundPolygon& polygon : views.both_eyes) drawing.fill(plan(polygon), {kWideBoth});
  for (const GroundPolygon& polygon : views.twice) drawing.fill(plan(polygon), {kWideTwice});
  for (const GroundPolygon& polygon : views.both_eyes) drawing.line(closed(plan(polygon)), {kWide, 1.2});
}

void draw_rings(Drawing& drawing, const Plan& plan, double radius_m, double half_deg) {
  for (const double r : marks(plan.at.px_per_m, radius_m)) {
    if (!(r > 0)) continue;
    drawing.line(plan.arc(r, -half_deg, half_deg), {kFaint, 0.8, 3});
    drawing.text(plan.polar(r, -half_deg) + Point(8, 14), fmt::format("{:.3g} m", r), {kInk, 13});
  }
}

// An arc with ends, and its meaning in its middle.
void draw_span(Drawing& drawing, const Plan& plan, double radius_m, double span_deg, const Rgb8& colour,
               const std::string& words) {
  if (!std::isfinite(span_deg)) return;
  const double half = span_deg / 2, tick = 6 / plan.at.px_per_m;
  // Letters are about two thirds as wide as high, in either output.
  const double words_m = 10.5 * static_cast<double>(words.size()) / plan.at.px_per_m;
  const double gap = std::min(half, words_m / 2 / radius_m / kRadiansPerDegree);
  for (const double end : {-half, half}) {
    drawing.line(plan.arc(radius_m, std::copysign(gap, end), end), {colour, 1.8});
    drawing.line({plan.polar(radius_m - tick, end), plan.polar(radius_m + tick, end)}, {colour, 1.8});
  }
  drawing.text(plan.polar(radius_m, 0) + Point(0, 5), words, {colour, 15, Anchor::middle});
}

void draw_azimuths(Drawing& drawing, const Plan& plan, double radius_m, const PanRequirements& asked,
                   const PanFigures& seen) {
  const double half = asked.azimuth_deg / 2, gap = 26 / plan.at.px_per_m;
  for (const double end : {-half, half}) {
    drawing.line({plan.polar(0, 0), plan.polar(radius_m + 3.4 * gap, end)}, {kInk, 1.2, 7});
  }
  draw_span(drawing, plan, radius_m + gap, seen.azimuth_far_stereo_deg, kWide,
            fmt::format("far edge, both eyes: {:.1f}°", seen.azimuth_far_stereo_deg));
  draw_span(drawing, plan, radius_m + 2 * gap, seen.azimuth_far_deg, kWideTwice,
            fmt::format("far edge, one eye: {:.1f}°", seen.azimuth_far_deg));
  draw_span(drawing, plan, radius_m + 3 * gap, asked.azimuth_deg, kInk,
            fmt::format("asked for: {}°", asked.azimuth_deg));
  if (seen.azimuth_held_to_m > 0 && seen.azimuth_held_to_m < radius_m) {
    const Point mark = plan.polar(seen.azimuth_held_to_m, half);
    drawing.line({mark + Point(-7, 0), mark + Point(7, 0)}, {kInk, 3});
    drawing.text(mark + Point(-14, 5),
                 fmt::format("both eyes see {}° up to here, {:.2f} m", asked.azimuth_deg, seen.azimuth_held_to_m),
                 {kInk, 14, Anchor::end, true});
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

void draw_legend(Drawing& drawing, double y_px, bool pans, bool narrow) {
  struct Entry {
    Rgb8 colour;
    double opacity;
    const char* words;
    bool shown;
  };
  const Entry entries[] = {{kWideOneEye, 1, "wide, one eye only", true},
                           {kWideBoth, 1, "wide, both eyes", true},
                           {kWideTwice, 1, "wide, from two pans", pans},
                           {kNarrow, 0.45, "narrow, both eyes", narrow},
                           {kUnseen, 1, "asked for, not seen", pans}};
  double x = kMargin_px;
  for (const Entry& entry : entries) {
    if (!entry.shown) continue;
    drawing.fill({{x, y_px}, {x + 22, y_px}, {x + 22, y_px + 14}, {x, y_px + 14}}, {entry.colour, entry.opacity});
    drawing.line(closed({{x, y_px}, {x + 22, y_px}, {x + 22, y_px + 14}, {x, y_px + 14}}), {kFaint, 0.8});
    drawing.text({x + 30, y_px + 12}, entry.words, {kInk, 14});
    x += 230;
  }
}

// Gives the plan's lower end, px.
// What there is to see from above, in metres, and how it lies in the picture.
struct PlanLayout {
  Plan plan;
  double radius_m, half_deg;
  double lower_end_px;
};

PlanLayout lay_out_plan(double top_px, const DrawnPair& wide, const Views& views,
                        const std::optional<PanFigures>& pans) {
  constexpr double kTallest_px = 700, kSpans_px = 92;  // the arcs of draw_azimuths() stand outside of the ground
  const double radius = std::max(farthest_corner_m(views.both_eyes), wide.requirements.range_m);
  const double half_deg = pans ? wide.requirements.pans->azimuth_deg / 2 : wide.figures.shape.hfov_deg / 2;
  const double widest_deg = pans ? std::max(half_deg, pans->azimuth_far_deg / 2) : half_deg;
  const double outside_px = pans ? kSpans_px : 0;

  Extent extent;
  for (const GroundPolygon& polygon : views.one_eye) extent.add(polygon);
  GroundPolygon arc;
  for (double a = -widest_deg; a <= widest_deg; a += 1) {
    arc.emplace_back(radius * std::cos(a * kRadiansPerDegree), radius * std::sin(a * kRadiansPerDegree));
  }
  extent.add(arc);
  const double aside = std::max(extent.high.y(), -extent.low.y());
  const double outside_aside_px = outside_px * std::sin(std::min(widest_deg, 90.0) * kRadiansPerDegree);
  const double scale =
      std::min((kWidth_px / 2.0 - 20 - outside_aside_px) / aside, kTallest_px / (extent.high.x() - extent.low.x()));
  const double below_px = std::max(34.0, -outside_px * std::cos(std::min(widest_deg, 180.0) * kRadiansPerDegree));
  const double origin_px = top_px + 20 + outside_px + scale * extent.high.x();
  return {{{{kWidth_px / 2.0, origin_px}, scale}}, radius, half_deg, origin_px - scale * extent.low.x() + below_px};
}

// Gives the plan's lower end, px.
double draw_plan(Drawing& drawing, double top_px, const std::vector<DrawnPair>& pairs,
                 const std::optional<PanFigures>& pans) {
  const DrawnPair& wide = pairs.front();
  const Views views = views_of(wide);
  const PlanLayout layout = lay_out_plan(top_px, wide, views, pans);
  const Plan& plan = layout.plan;

  if (pans) {
    Points asked_for = plan.arc(wide.requirements.range_m, -layout.half_deg, layout.half_deg);
    asked_for.push_back(plan.polar(0, 0));
    drawing.fill(asked_for, {kUnseen});
  }
  draw_views(drawing, plan, views);
  if (pairs.size() > 1) {
    const GroundPolygon narrow = common_footprint(pairs[1].view(), 0);
    drawing.fill(plan(narrow), {kNarrow, 0.45});
    drawing.line(closed(plan(narrow)), {kNarrow, 1.5});
    drawing.text(plan.polar(0.85 * pairs[1].figures.view_far_m, 0), "narrow pair", {kInk, 15, Anchor::middle, true});
  }
  draw_rings(drawing, plan, layout.radius_m, layout.half_deg);
  if (pans) {
    draw_azimuths(drawing, plan, layout.radius_m, *wide.requirements.pans, *pans);
    for (const double pan : wide.requirements.pans->angles_deg) {
      drawing.text(plan.polar(0.85 * wide.figures.view_far_m, pan), fmt::format("pan {}°", pan),
                   {kInk, 15, Anchor::middle, true});
    }
  }
  const Point rover = plan.polar(0, 0);
  if (wide.figures.view_near_m > 0) {
    drawing.text(rover + Point(18, 14), "blind before the rover", {kInk, 14, Anchor::start, true});
  }
  drawing.fill({rover + Point(-7, 7), rover + Point(7, 7), rover + Point(0, -8)}, {kInk});
  return layout.lower_end_px;
}

std::string caption(const DrawnPair& pair) {
  const PairShape& shape = pair.figures.shape;
  return fmt::format("{}: baseline {} m, {} px of {} um, {}° wide, {:.2f} mm; {} m resolution holds to {:.2f} m",
                     pair.name, shape.baseline_m, shape.width_px, shape.pixel_size_um, shape.hfov_deg,
                     pair.figures.focal_length_mm, pair.requirements.range_resolution_m, pair.figures.range_m);
}

}  // namespace

std::optional<Drawing> draw_ground(const RigRequirements& requirements, const RigDesign& design) {
  const PairFigures* wide = design.wide.chosen();
  if (!wide) return std::nullopt;
  std::vector<DrawnPair> pairs{{"wide", kWide, requirements.wide, *wide}};
  const PairFigures* narrow = design.narrow ? design.narrow->chosen() : nullptr;
  if (narrow) pairs.push_back({"narrow", kNarrow, *requirements.narrow, *narrow});

  // Once on endless paper, to see how long it gets.
  const auto draw_on = [&](Drawing& drawing) {
    drawing.text({kMargin_px, 40}, "Level ground seen by " + requirements.name, kTitle);
    double y = 40;
    for (const DrawnPair& pair : pairs) drawing.text({kMargin_px, y += 22}, caption(pair), {pair.colour, 14});
    y = draw_side(drawing, y + 10, pairs, design.view_overlap_m);
    y = draw_plan(drawing, y, pairs, design.pans);
    if (design.pans && std::isfinite(design.pans->overlap_percent)) {
      drawing.text(
          {kMargin_px, y += 16},
          fmt::format("Neighbouring pans overlap by {:.1f} % of the view, at the far edge by {:.1f} % (one eye) "
                      "and {:.1f} % (both eyes)",
                      design.pans->overlap_percent, design.pans->far_overlap_percent,
                      design.pans->far_overlap_stereo_percent),
          {kInk, 14});
    }
    draw_legend(drawing, y += 18, design.pans.has_value(), narrow != nullptr);
    return static_cast<int>(std::ceil(y)) + 34;
  };
  Drawing endless(kWidth_px, 1);
  Drawing drawing(kWidth_px, draw_on(endless));
  draw_on(drawing);
  return drawing;
}

}  // namespace spartan::program
