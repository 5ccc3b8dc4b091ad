#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "spartan/report/internal/ground_plan.h"
#include "spartan/report/internal/ground_side.h"
#include "spartan/report/report.h"
#include "spartan/rig_design/rig_designer.h"

namespace spartan {

using namespace internal;

namespace {

// Gives the row, px, below which nothing is drawn.
double draw_legend(Drawing& drawing, double y_px, const std::vector<DrawnPair>& pairs, bool pans) {
  struct Entry {
    Rgb8 colour;
    double opacity;
    std::string text;
  };
  const std::string& first = pairs.front().name;
  std::vector<Entry> entries{{kFirstPairOneCamera, 1, first + ", one camera only"},
                             {kFirstPairBoth, 1, first + ", both cameras"}};
  if (pans) entries.push_back({kFirstPairTwice, 1, first + ", from two pans"});
  for (std::size_t i = 1; i < pairs.size(); ++i)
    entries.push_back({pairs[i].colour, 0.45, pairs[i].name + ", both cameras"});
  if (pans) entries.push_back({kUnseen, 1, "required, not seen"});
  constexpr double kRow_px = 24, kLetter_px = 7.5;
  double x = kMargin_px;
  for (const Entry& entry : entries) {
    const double width = std::max(230.0, 52 + kLetter_px * static_cast<double>(entry.text.size()));
    if (x > kMargin_px && x + width > kWidth_px) {
      x = kMargin_px;
      y_px += kRow_px;
    }
    drawing.fill({{x, y_px}, {x + 22, y_px}, {x + 22, y_px + 14}, {x, y_px + 14}}, {entry.colour, entry.opacity});
    drawing.line(closed({{x, y_px}, {x + 22, y_px}, {x + 22, y_px + 14}, {x, y_px + 14}}), {kFaint, 0.8});
    drawing.text({x + 30, y_px + 12}, entry.text, {kInk, 14});
    x += width;
  }
  return y_px;
}

// The pair with pans first, or, without pans, the first one. Pairs without a selection are not drawn.
std::vector<DrawnPair> drawn_pairs(const RigRequirements& requirements, const RigDesign& design) {
  std::vector<DrawnPair> pairs;
  std::size_t first = requirements.panned();
  if (!requirements.pairs[first].pans) {
    while (first < design.pairs.size() && design.pairs[first].selected() == nullptr) ++first;
  }
  const PairMetrics* const primary = first < design.pairs.size() ? design.pairs[first].selected() : nullptr;
  if (primary == nullptr) return pairs;
  pairs.push_back({design.pairs[first].name, kFirstPair, requirements.pairs[first], *primary});
  for (std::size_t i = 0; i < design.pairs.size(); ++i) {
    const PairMetrics* const pair = design.pairs[i].selected();
    if (i == first || pair == nullptr) continue;
    pairs.push_back(
        {design.pairs[i].name, kOtherPairs[(pairs.size() - 1) % kOtherPairs.size()], requirements.pairs[i], *pair});
  }
  return pairs;
}

std::string caption(const DrawnPair& pair) {
  const PairParameters& parameters = pair.figures.parameters;
  return fmt::format(
      "{}: baseline {} m, {} px of {} um, HFOV {}°, focal length {:.2f} mm; range resolution {} m up to {:.2f} m",
      pair.name, parameters.baseline_m, parameters.width_px, parameters.pixel_size_um, parameters.hfov_deg,
      pair.figures.focal_length_mm, pair.requirements.range_resolution_m, pair.figures.range_m);
}

}  // namespace

std::optional<GroundFigure> draw_ground(const RigRequirements& requirements, const RigDesign& design) {
  const std::vector<DrawnPair> pairs = drawn_pairs(requirements, design);
  if (pairs.empty()) return std::nullopt;
  constexpr Lettering kTitle{kInk, 22};

  // Drawn once to find the height.
  const auto draw_on = [&](Drawing& drawing) {
    drawing.text({kMargin_px, 40}, "Level ground seen by " + requirements.name, kTitle);
    double y = 40;
    for (const DrawnPair& pair : pairs) drawing.text({kMargin_px, y += 22}, caption(pair), {pair.colour, 14});
    y = draw_side(drawing, y + 10, pairs, design.view_overlap_m);
    y = draw_plan(drawing, y, pairs, design.pans);
    if (design.pans && design.pans->overlap) {
      drawing.text({kMargin_px, y += 16}, describe_overlaps(*design.pans, "°"), {kInk, 14});
    }
    y = draw_legend(drawing, y + 18, pairs, design.pans.has_value());
    return static_cast<int>(std::ceil(y)) + 34;
  };
  Drawing endless(kWidth_px, 1);
  Drawing drawing(kWidth_px, draw_on(endless));
  draw_on(drawing);
  return GroundFigure{drawing.to_svg(), drawing.to_image()};
}

}  // namespace spartan
