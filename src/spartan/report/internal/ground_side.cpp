#include "spartan/report/internal/ground_side.h"

#include <fmt/format.h>

#include <algorithm>

namespace spartan::internal {
namespace {

constexpr double kLabels_px = 270;  // column for labels beside the side view
constexpr Lettering kSmall{kFaint, 13};

void draw_pair_from_side(Drawing& drawing, const Scale& at, const DrawnPair& pair) {
  const double height = pair.requirements.height_m;
  const Point camera = at(0, height), near = at(pair.figures.view_near_m, 0), far = at(pair.figures.view_far_m, 0);
  drawing.fill({camera, near, far}, {pair.colour, 0.18});
  drawing.line({near, camera, far}, {pair.colour, 1.5});
  drawing.fill({camera + Point(-9, -6), camera + Point(9, -6), camera + Point(9, 6), camera + Point(-9, 6)},
               {pair.colour});
  const auto label = [&](double below_px, const std::string& text) {
    drawing.text(camera + Point(-22, below_px), text, {pair.colour, 14, Anchor::end});
  };
  label(0, fmt::format("{} pair, {} m high", pair.name, height));
  label(17, fmt::format("tilt {}° down, vertical FOV {:.1f}°", pair.figures.tilt_deg, pair.figures.vfov_deg));
}

// The ground seen by a pair as a bar: full colour up to where the required resolution holds, a mark at the required
// range.
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
  const double required = at(pair.requirements.range_m, 0).x();
  drawing.line({{required, y_px - 3}, {required, y_px + 15}}, {kInk, 2.5});
  drawing.text({kLabels_px - 22, y_px + 11}, fmt::format("{}: {:.3f} to {:.3f} m", pair.name, near, far),
               {pair.colour, 14, Anchor::end});
}

void draw_plain_bar(Drawing& drawing, const Scale& at, double y_px, double from_m, double to_m, const Rgb8& colour,
                    const std::string& text) {
  const double from = at(from_m, 0).x(), to = at(to_m, 0).x();
  drawing.fill({{from, y_px}, {to, y_px}, {to, y_px + 12}, {from, y_px + 12}}, {colour, 0.9});
  drawing.text({kLabels_px - 22, y_px + 11}, text, {kInk, 14, Anchor::end});
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
    draw_plain_bar(drawing, at, y_px, from, from + *shared_m, kShared,
                   fmt::format("{}: {:.2f} m", pairs.size() == 2 ? "both" : "all", *shared_m));
    y_px += 24;
  }
  if (near > 0) draw_plain_bar(drawing, at, y_px, 0, near, kFaint, fmt::format("blind: up to {:.3f} m", near));
  drawing.text({at(0, 0).x(), y_px + 38}, "full colour: required resolution met; black mark: required range", kSmall);
}

}  // namespace

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

}  // namespace spartan::internal
