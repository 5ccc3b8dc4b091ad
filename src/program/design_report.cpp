#include "program/design_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>

#include "spartan/rig_design/rig_designer.h"

namespace spartan::program {
namespace {

constexpr const char* kHead =
    "                   baseline [m]  nearest [m]  hfov [deg]  width [px]  pixel [um]  focal [mm]  range [m]  stereo "
    "angle "
    "[deg]  search range [%]  pan overlap [%]  tilt [deg]  ground seen [m]\n";

std::string percent_or_dash(double value) {
  return std::isnan(value) ? "-" : fmt::format("{:.1f}", value);
}

std::string row(const std::string& name, const PairMetrics& pair) {
  return fmt::format(
      "{:>17}  {:>12}  {:>11}  {:>10}  {:>10}  {:>10}  {:10.2f}  {:9.3f}  {:18.2f}  {:16.2f}  {:>15}  {:>10}  {:.3f} - "
      "{:.3f}\n",
      name, pair.parameters.baseline_m, pair.parameters.nearest_m, pair.parameters.hfov_deg, pair.parameters.width_px,
      pair.parameters.pixel_size_um, pair.focal_length_mm, pair.range_m, pair.stereo_angle_deg, pair.search_percent,
      percent_or_dash(pair.pan_overlap_percent), pair.tilt_deg, pair.view_near_m, pair.view_far_m);
}

std::string margins_of(const PairMetrics& pair) {
  const PairMargins& margins = pair.margins;
  std::string text =
      fmt::format("range {:+.3f} m, stereo angle {:+.2f} deg, search range {:+.2f} %, baseline {:+.2f} m",
                  margins.range_m, margins.stereo_angle_deg, margins.search_percent, margins.baseline_m);
  if (!std::isnan(margins.pan_overlap_percent))
    text += fmt::format(", pan overlap {:+.1f} %", margins.pan_overlap_percent);
  return text;
}

std::string name_of(DesignCriterion criterion) {
  switch (criterion) {
    case DesignCriterion::range_margin:
      return "larger margin in range";
    case DesignCriterion::pan_overlap:
      return "larger overlap of the pans";
    case DesignCriterion::shorter_baseline:
      return "shorter baseline";
  }
  return "";
}

std::string pair_text(const PairRequirements& required, const PairDesign& design, std::size_t rows) {
  std::vector<std::string> order;
  order.reserve(required.order.size());
  for (const DesignCriterion criterion : required.order) order.push_back(name_of(criterion));
  std::string text = fmt::format("pair {}: {} of {} combinations are feasible", required.name, design.feasible.size(),
                                 design.combinations);
  if (design.with_pan_overlap_count) {
    text += fmt::format("; with neighbouring pans that overlap by at least {} %: {}",
                        required.pans->smallest_overlap_percent, *design.with_pan_overlap_count);
  }
  text += fmt::format(
      "\nrequired: {} m resolution to {} m at a disparity accuracy of {} px, stereo angle at most {} deg, search range "
      "at most "
      "{} % of the image width, baseline at least {} m, camera height at least {} m (it is {} m)\n",
      required.range_resolution_m, required.range_m, required.disparity_accuracy_px, required.largest_stereo_angle_deg,
      required.largest_search_percent, required.smallest_baseline_m, required.smallest_height_m, required.height_m);
  text += fmt::format("order: {}; equal ones in the order of the requirements file ({} are equal to the best)\n",
                      fmt::join(order, ", then "), design.equally_good);
  text += kHead;
  const std::size_t listed = std::min(rows, design.feasible.size());
  for (std::size_t i = 0; i < listed; ++i) text += row(fmt::format("{}.", i + 1), design.feasible[i]);
  if (listed < design.feasible.size()) {
    text += fmt::format("{:>17}  {} more; --all lists them, -o writes them\n", "...", design.feasible.size() - listed);
  }
  if (const PairMetrics* best = design.best()) text += row("best", *best);
  if (design.best_with_pan_overlap) text += row("best with overlap", *design.best_with_pan_overlap);
  if (design.nearest) text += row("nearest", *design.nearest);
  if (design.published) text += row("published", *design.published);
  if (const PairMetrics* best = design.best()) text += "margins of the best: " + margins_of(*best) + "\n";
  if (design.nearest) text += "margins of the nearest candidate: " + margins_of(*design.nearest) + "\n";
  if (design.best_with_pan_overlap) {
    text += "margins of the best with enough overlap: " + margins_of(*design.best_with_pan_overlap) + "\n";
  }
  if (design.published) {
    text += fmt::format("published pair (`published` in the requirements file; {}, {}): margins: {}\n",
                        design.published->feasible ? "feasible" : "not feasible",
                        design.published_is_candidate ? "one of the combinations" : "none of the combinations",
                        margins_of(*design.published));
  }
  return text + "\n";
}

std::string ground_text(const RigDesign& design) {
  std::string text;
  if (design.view_overlap_m) {
    text += fmt::format("ground seen by {} pairs, middle column: {:.2f} m\n", design.pairs.size() == 2 ? "both" : "all",
                        *design.view_overlap_m);
  }
  if (!design.pans) return text;
  const PanCoverage& pans = *design.pans;
  if (pans.overlap) text += describe_overlaps(pans) + "\n";
  text += fmt::format(
      "part of the required azimuth that the pans cover at the far edge: {:.1f} deg (one camera), {:.1f} deg (both)\n",
      pans.azimuth_far.width_deg(), pans.azimuth_far_stereo.width_deg());
  if (!pans.full_coverage) return text + "there is no distance at which both cameras cover the required azimuth\n";
  return text + fmt::format("both cameras cover the required azimuth from {:.2f} m to {:.2f} m\n",
                            pans.full_coverage->from_m, pans.full_coverage->to_m);
}

}  // namespace

std::string design_text(const RigRequirements& requirements, const RigDesign& design, std::size_t rows) {
  std::string text;
  for (std::size_t i = 0; i < design.pairs.size(); ++i) text += pair_text(requirements.pairs[i], design.pairs[i], rows);
  text += ground_text(design);
  text +=
      "stereo angle: between the lines of sight of both cameras at the nearest distance; search range: the largest "
      "disparity\nin percent of the image width; range: the farthest distance with the required resolution; ground "
      "seen: "
      "in the middle column\n";
  if (!design.warnings.empty()) text += "\nwarnings:\n";
  for (const DesignWarning& warning : design.warnings) text += fmt::format("  {}: {}\n", warning.id, warning.text);
  return text;
}

std::string design_csv(const RigDesign& design) {
  std::string text =
      "pair,rank,baseline_m,nearest_m,hfov_deg,width_px,pixel_size_um,focal_length_mm,range_m,stereo_angle_deg,search_"
      "percent,"
      "pan_overlap_percent,enough_pan_overlap,tilt_deg,view_near_m,view_far_m\n";
  for (const PairDesign& pairs : design.pairs) {
    std::size_t rank = 0;
    for (const PairMetrics& pair : pairs.feasible) {
      text += fmt::format("{},{},{},{},{},{},{},{:.4f},{:.6f},{:.5f},{:.5f},{},{},{},{:.5f},{:.5f}\n", pairs.name,
                          ++rank, pair.parameters.baseline_m, pair.parameters.nearest_m, pair.parameters.hfov_deg,
                          pair.parameters.width_px, pair.parameters.pixel_size_um, pair.focal_length_mm, pair.range_m,
                          pair.stereo_angle_deg, pair.search_percent,
                          std::isnan(pair.pan_overlap_percent) ? "" : fmt::format("{:.5f}", pair.pan_overlap_percent),
                          pair.with_pan_overlap ? 1 : 0, pair.tilt_deg, pair.view_near_m, pair.view_far_m);
    }
  }
  return text;
}

}  // namespace spartan::program
