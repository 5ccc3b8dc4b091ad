#include <fmt/format.h>

#include <cmath>

#include "spartan/report/internal/ground_plan.h"
#include "spartan/report/internal/ground_side.h"
#include "spartan/report/report.h"
#include "spartan/rig_design/rig_designer.h"

namespace spartan {

using namespace internal;

namespace {

void draw_legend(Drawing& drawing, double y_px, bool pans, bool narrow) {
  struct Entry {
    Rgb8 colour;
    double opacity;
    const char* text;
    bool shown;
  };
  const Entry entries[] = {{kWideOneCamera, 1, "wide, one camera only", true},
                           {kWideBoth, 1, "wide, both cameras", true},
                           {kWideTwice, 1, "wide, from two pans", pans},
                           {kNarrow, 0.45, "narrow, both cameras", narrow},
                           {kUnseen, 1, "required, not seen", pans}};
  double x = kMargin_px;
  for (const Entry& entry : entries) {
    if (!entry.shown) continue;
    drawing.fill({{x, y_px}, {x + 22, y_px}, {x + 22, y_px + 14}, {x, y_px + 14}}, {entry.colour, entry.opacity});
    drawing.line(closed({{x, y_px}, {x + 22, y_px}, {x + 22, y_px + 14}, {x, y_px + 14}}), {kFaint, 0.8});
    drawing.text({x + 30, y_px + 12}, entry.text, {kInk, 14});
    x += 230;
  }
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
  const PairMetrics* wide = design.wide.selected();
  if (!wide) return std::nullopt;
  constexpr Lettering kTitle{kInk, 22};
  std::vector<DrawnPair> pairs{{"wide", kWide, requirements.wide, *wide}};
  const PairMetrics* narrow = design.narrow ? design.narrow->selected() : nullptr;
  if (narrow) pairs.push_back({"narrow", kNarrow, *requirements.narrow, *narrow});

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
    draw_legend(drawing, y += 18, design.pans.has_value(), narrow != nullptr);
    return static_cast<int>(std::ceil(y)) + 34;
  };
  Drawing endless(kWidth_px, 1);
  Drawing drawing(kWidth_px, draw_on(endless));
  draw_on(drawing);
  return GroundFigure{drawing.to_svg(), drawing.to_image()};
}

}  // namespace spartan
