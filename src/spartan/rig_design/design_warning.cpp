#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/rig_design/internal/stereo_relations.h"
#include "spartan/rig_design/rig_designer.h"

namespace spartan {

using namespace internal;

namespace {

// Published values are rounded: relative differences below this are accepted.
constexpr double kRoundingTolerance = 0.01;
// A limit is violated where it is exceeded by more than rounding errors.
constexpr double kMarginTolerance = 1e-9;

// One pair with its requirements and results, and the list that receives its warnings.
struct PairContext {
  std::string name;
  const PairRequirements& requirements;
  const PairDesign& design;
  std::vector<DesignWarning>& warnings;

  void warn(const char* id, double value, const std::string& text) const {
    warnings.push_back({id, name, name + ": " + text, value});
  }
};

// --- the search ---

// Which limits no combination meets by itself, and what the nearest one violates, by how much.
std::string why_nothing(const PairContext& c) {
  const PairRequirements& required = c.requirements;
  const LimitCounts& meeting = c.design.meeting;
  std::vector<std::string> never;
  if (meeting.range == 0) never.push_back(fmt::format("a range of {} m", required.range_m));
  if (meeting.stereo_angle == 0)
    never.push_back(fmt::format("a stereo angle of at most {} deg", required.largest_stereo_angle_deg));
  if (meeting.search == 0)
    never.push_back(fmt::format("a search range of at most {} %", required.largest_search_percent));
  if (meeting.baseline == 0) never.push_back(fmt::format("a baseline of at least {} m", required.smallest_baseline_m));
  std::string text = never.empty() ? "each limit can be met, but not all together"
                                   : fmt::format("none has {}", fmt::join(never, ", nor "));
  if (!c.design.nearest) return text;
  const PairMetrics& nearest = *c.design.nearest;
  std::vector<std::string> short_of;
  const auto add = [&](const char* what, double margin, double limit, const char* unit) {
    if (margin < -kMarginTolerance)
      short_of.push_back(fmt::format("{} by {:.3g} {} ({:.0f} %)", what, -margin, unit, -100 * margin / limit));
  };
  add("range", nearest.margins.range_m, required.range_m, "m");
  add("stereo angle", nearest.margins.stereo_angle_deg, required.largest_stereo_angle_deg, "deg");
  add("search range", nearest.margins.search_percent, required.largest_search_percent, "% of the width");
  add("baseline", nearest.margins.baseline_m, required.smallest_baseline_m, "m");
  const PairParameters& p = nearest.parameters;
  return text + fmt::format("; the nearest candidate (baseline {} m, nearest {} m, {} deg, {} px of {} um) misses: {}",
                            p.baseline_m, p.nearest_m, p.hfov_deg, p.width_px, p.pixel_size_um,
                            fmt::join(short_of, ", "));
}

void warn_about_choice(const PairContext& c) {
  const std::size_t count = c.design.feasible.size();
  if (count == 0) {
    c.warn("nothing_feasible", 0,
           fmt::format("none of the {} combinations is feasible: {}", c.design.combinations, why_nothing(c)));
    return;
  }
  const bool published_is_solution =
      c.design.published && c.design.published->feasible && c.design.published_is_candidate;
  if (!published_is_solution || count < 2) return;
  std::string text =
      fmt::format("the published pair is not the only solution: {} other combinations are feasible", count - 1);
  if (c.design.with_pan_overlap_count && c.design.published->with_pan_overlap) {
    text += fmt::format(", {} of them with enough overlap of the pans", *c.design.with_pan_overlap_count - 1);
  }
  c.warn("not_unique", static_cast<double>(count - 1), text);
}

// Whether every combination that is feasible with one pixel size is feasible with all.
void warn_about_pixel_size(const PairContext& c) {
  const std::size_t sizes = c.requirements.lists.pixel_sizes_um.size();
  std::vector<std::tuple<double, double, double, int>> others;
  others.reserve(c.design.feasible.size());
  for (const PairMetrics& pair : c.design.feasible) {
    others.emplace_back(pair.parameters.baseline_m, pair.parameters.nearest_m, pair.parameters.hfov_deg,
                        pair.parameters.width_px);
  }
  std::sort(others.begin(), others.end());
  others.erase(std::unique(others.begin(), others.end()), others.end());
  if (others.empty() || sizes < 2 || others.size() * sizes != c.design.feasible.size()) return;
  c.warn("pixel_size_never_binds", static_cast<double>(others.size()),
         fmt::format("the pixel size has no influence: each of the {} sizes has the same {} feasible combinations of "
                     "the other parameters",
                     sizes, others.size()));
}

void warn_about_baseline_limit(const PairContext& c) {
  PairRequirements without = c.requirements;
  without.smallest_baseline_m = 0;
  if (c.design.feasible.empty() || !(c.requirements.smallest_baseline_m > 0) ||
      count_feasible(without) != c.design.feasible.size()) {
    return;
  }
  const auto shortest =
      std::min_element(c.design.feasible.begin(), c.design.feasible.end(),
                       [](const auto& a, const auto& b) { return a.parameters.baseline_m < b.parameters.baseline_m; });
  c.warn("baseline_limit_never_binds", shortest->parameters.baseline_m,
         fmt::format("the minimum baseline of {} m is never active: the other limits allow none below {} m",
                     c.requirements.smallest_baseline_m, shortest->parameters.baseline_m));
}

void warn_about_stereo_angles(const PairContext& c) {
  const PairMetrics* pair = c.design.selected();
  if (!c.requirements.contradicting_stereo_angle_deg || !pair) return;
  PairRequirements other = c.requirements;
  other.largest_stereo_angle_deg = *c.requirements.contradicting_stereo_angle_deg;
  c.warn(
      "stereo_angle_limits_disagree", pair->stereo_angle_deg,
      fmt::format("two limits of the stereo angle are given, {} deg and {} deg; the pair has {:.1f} deg. With {} deg "
                  "{} of {} combinations are feasible",
                  c.requirements.largest_stereo_angle_deg, other.largest_stereo_angle_deg, pair->stereo_angle_deg,
                  other.largest_stereo_angle_deg, count_feasible(other), c.design.combinations));
}

void warn_about_rounding(const PairContext& c) {
  if (!(c.design.smallest_limit_distance < kMarginTolerance)) return;
  c.warn("on_a_limit", c.design.smallest_limit_distance,
         "a combination is within 1e-9 of a limit; values on a limit count as feasible");
}

// --- the published pair by itself ---

void warn_about_limits(const PairContext& c, const PairMetrics& pair) {
  const PairRequirements& required = c.requirements;
  if (pair.margins.stereo_angle_deg < -kMarginTolerance) {
    c.warn("stereo_angle_large", pair.stereo_angle_deg,
           fmt::format("the published pair has a stereo angle of {:.1f} deg, at most {} deg are allowed",
                       pair.stereo_angle_deg, required.largest_stereo_angle_deg));
  }
  if (pair.margins.search_percent < -kMarginTolerance) {
    c.warn("search_large", pair.search_percent,
           fmt::format(
               "the published pair has a disparity search range of {:.1f} % of the width, at most {} % are allowed",
               pair.search_percent, required.largest_search_percent));
  }
  if (pair.margins.baseline_m < -kMarginTolerance) {
    c.warn("baseline_short", pair.parameters.baseline_m,
           fmt::format("the published pair has a baseline of {} m, at least {} m are required",
                       pair.parameters.baseline_m, required.smallest_baseline_m));
  }
}

// The range at which the resolution is met, if it is too short, and two remedies.
void warn_about_range(const PairContext& c, const PairMetrics& pair) {
  if (pair.margins.range_m >= -kMarginTolerance) return;
  const PairRequirements& required = c.requirements;
  const double hfov_rad = pair.parameters.hfov_deg * kRadiansPerDegree;
  const StereoGeometry parameters{pair.parameters.baseline_m, static_cast<double>(pair.parameters.width_px), hfov_rad};
  const DepthAccuracy accuracy{required.range_resolution_m, required.disparity_accuracy_px};
  c.warn("range_short", pair.range_m,
         fmt::format("at c = {} px the range resolution of {} m is met up to {:.2f} m, not up to {} m",
                     required.disparity_accuracy_px, required.range_resolution_m, pair.range_m, required.range_m));
  const double needed_px = accuracy_for_range_px(parameters, required.range_resolution_m, required.range_m);
  c.warn("accuracy_needed", needed_px,
         fmt::format("a range of {} m requires a disparity accuracy of c = {:.2f} px", required.range_m, needed_px));

  const double needed_width = width_for_range_px(parameters, accuracy, required.range_m);
  std::vector<int> widths = required.lists.widths_px;
  std::sort(widths.begin(), widths.end());
  const auto enough = std::lower_bound(widths.begin(), widths.end(), needed_width);
  std::string text = fmt::format("alternatively an image width of {:.0f} px", std::ceil(needed_width));
  double reach_m = required.range_m;
  if (enough != widths.end()) {
    reach_m = max_range_m({parameters.baseline_m, static_cast<double>(*enough), hfov_rad}, accuracy);
    text += fmt::format("; of the candidates {} px, which reach {:.2f} m", *enough, reach_m);
  }
  c.warn("width_needed", reach_m, text);
}

// The lowest row sees ground nearer than the nearest depth of the matching.
void warn_about_near_ground(const PairContext& c, const PairMetrics& pair) {
  const double tilt_rad = pair.tilt_deg * kRadiansPerDegree;
  const double lowest_rad = std::min(tilt_rad + pair.vfov_deg / 2 * kRadiansPerDegree, std::numbers::pi / 2);
  const double nearest_m = c.requirements.height_m / std::sin(lowest_rad);
  if (nearest_m < pair.parameters.nearest_m) {
    c.warn("nearest_row", nearest_m,
           fmt::format("the lowest row sees ground at a distance of {:.2f} m, nearer than d_min = {} m", nearest_m,
                       pair.parameters.nearest_m));
  }
  // Depth, along the optical axis, of the ground in the lowest row, by the number of rows with square pixels.
  const double hfov_rad = pair.parameters.hfov_deg * kRadiansPerDegree;
  const double vfov_rad = vertical_view_rad(hfov_rad, c.requirements.published_rows_per_column());
  const double depth_m = c.requirements.height_m * std::cos(vfov_rad / 2) / std::sin(tilt_rad + vfov_rad / 2);
  const StereoGeometry parameters{pair.parameters.baseline_m, static_cast<double>(pair.parameters.width_px), hfov_rad};
  const double largest_px = disparity_px(parameters, depth_m),
               searched_px = disparity_px(parameters, pair.parameters.nearest_m);
  if (largest_px > searched_px * (1 + kRoundingTolerance)) {
    c.warn(
        "largest_disparity", largest_px,
        fmt::format("the lowest row has disparities of up to {:.0f} px (square pixels); d_min corresponds to {:.0f} px",
                    largest_px, searched_px));
  }
}

void warn_about_optics(const PairContext& c, const PairMetrics& pair) {
  const PublishedPair& published = *c.requirements.published;
  const double hfov_rad = pair.parameters.hfov_deg * kRadiansPerDegree;
  if (published.focal_length_mm &&
      std::abs(*published.focal_length_mm / pair.focal_length_mm - 1) > kRoundingTolerance) {
    c.warn("focal_length_misfit", pair.focal_length_mm,
           fmt::format("{} deg over {} px of {} um require a focal length of {:.2f} mm, {} mm is published",
                       pair.parameters.hfov_deg, pair.parameters.width_px, pair.parameters.pixel_size_um,
                       pair.focal_length_mm, *published.focal_length_mm));
  }
  const double rows_per_column = c.requirements.published_rows_per_column();
  const double square_deg = vertical_view_rad(hfov_rad, rows_per_column) / kRadiansPerDegree;
  if (published.vfov_deg && std::abs(*published.vfov_deg / square_deg - 1) > kRoundingTolerance) {
    c.warn("vertical_view_misfit", square_deg,
           fmt::format("square pixels with {} deg horizontally have {:.1f} deg vertically, {} deg is published",
                       pair.parameters.hfov_deg, square_deg, *published.vfov_deg));
  }
}

// --- pans ---

void warn_about_azimuth(const PairContext& c, const PanCoverage& pans) {
  const AzimuthSet required = required_azimuth(*c.requirements.pans);
  if (!pans.azimuth_far.covers(required)) {
    const double seen_deg = pans.azimuth_far.width_deg();
    c.warn("azimuth_far", seen_deg,
           fmt::format(
               "at the far edge the pans cover {:.1f} of the required {} deg (one camera, corners of the top row): "
               "{}",
               seen_deg, required.width_deg(), to_text(pans.azimuth_far)));
  }
  if (pans.azimuth_far_stereo.covers(required)) return;
  const double seen_deg = pans.azimuth_far_stereo.width_deg();
  c.warn("azimuth_far_stereo", seen_deg,
         fmt::format("at the far edge both cameras cover {:.1f} of the required {} deg: {}", seen_deg,
                     required.width_deg(), to_text(pans.azimuth_far_stereo)));
  const std::string where = pans.full_coverage ? fmt::format("only from {:.2f} m to {:.2f} m",
                                                             pans.full_coverage->from_m, pans.full_coverage->to_m)
                                               : "at no distance";
  c.warn("azimuth_held_to", pans.full_coverage ? pans.full_coverage->to_m : 0,
         fmt::format("both cameras cover all of the {} deg {}", required.width_deg(), where));
}

void warn_about_overlap(const PairContext& c, const PanCoverage& pans) {
  if (!pans.overlap) return;
  const double required_percent = c.requirements.pans->smallest_overlap_percent, percent = pans.overlap->percent();
  if (percent < required_percent - kMarginTolerance) {
    c.warn("pan_overlap", percent,
           fmt::format("neighbouring pans {}{}, an overlap of {} % is required", to_text(*pans.overlap),
                       percent >= 0 ? " of the view" : "", required_percent));
  }
  const auto at_far_edge = [&](const char* id, const char* who, const std::optional<PanOverlap>& far) {
    if (!far || !(far->percent() < percent - 1)) return;
    c.warn(id, far->percent(),
           fmt::format("neighbouring pans {} nominally, at the top row they {} ({}); an overlap of {} % is required",
                       to_text(*pans.overlap), to_text(*far), who, required_percent));
  };
  at_far_edge("pan_overlap_far", "one camera", pans.far_overlap);
  at_far_edge("pan_overlap_far_stereo", "both cameras", pans.far_overlap_stereo);
}

void add_warnings(const PairContext& c) {
  warn_about_choice(c);
  warn_about_pixel_size(c);
  warn_about_baseline_limit(c);
  warn_about_stereo_angles(c);
  warn_about_rounding(c);
  if (!c.design.published) return;
  warn_about_limits(c, *c.design.published);
  warn_about_range(c, *c.design.published);
  warn_about_near_ground(c, *c.design.published);
  warn_about_optics(c, *c.design.published);
}

}  // namespace

std::vector<DesignWarning> find_design_warnings(const RigRequirements& requirements, const RigDesign& design) {
  std::vector<DesignWarning> warnings;
  for (std::size_t i = 0; i < requirements.pairs.size(); ++i) {
    const PairContext context{requirements.pairs[i].name, requirements.pairs[i], design.pairs[i], warnings};
    add_warnings(context);
    if (i != requirements.panned()) continue;
    if (design.pans) {
      warn_about_azimuth(context, *design.pans);
      warn_about_overlap(context, *design.pans);
    }
    if (design.view_overlap_m && !(*design.view_overlap_m > 0)) {
      context.warn("views_apart", 0, "no ground is visible to all pairs");
    }
  }
  return warnings;
}

}  // namespace spartan
