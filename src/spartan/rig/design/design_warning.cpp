#include "spartan/rig/design/design_warning.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "spartan/rig/design/pan_words.h"
#include "spartan/rig/design/rig_designer.h"
#include "spartan/rig/design/stereo_relations.h"

namespace spartan {
namespace {

constexpr double kRadiansPerDegree = std::numbers::pi / 180;
// Published figures are rounded; what differs by less fits.
constexpr double kRounded = 0.01;
// A limit is missed where it is missed by more than rounding.
constexpr double kSame = 1e-9;

// One pair with what is known of it, and where its warnings go.
struct Case {
  std::string name;
  const PairRequirements& requirements;
  const PairDesign& design;
  std::vector<DesignWarning>& warnings;

  void warn(const char* id, double value, const std::string& text) const {
    warnings.push_back({id, name, name + ": " + text, value});
  }
};

// --- the search ---

void warn_of_choice(const Case& c) {
  const std::size_t count = c.design.feasible.size();
  if (count == 0) {
    c.warn("nothing_feasible", 0, fmt::format("none of the {} combinations is feasible", c.design.combinations));
    return;
  }
  const bool chosen_one = c.design.published && c.design.published->feasible && c.design.published_on_offer;
  if (!chosen_one || count < 2) return;
  std::string text =
      fmt::format("the published pair is not the only one: {} other combinations are feasible", count - 1);
  if (c.design.with_pan_overlap_count && c.design.published->with_pan_overlap) {
    text += fmt::format(", {} of them with enough overlap of the pans", *c.design.with_pan_overlap_count - 1);
  }
  c.warn("not_unique", static_cast<double>(count - 1), text);
}

// Feasible with one size, feasible with all of them?
void warn_of_pixel_size(const Case& c) {
  const std::size_t sizes = c.requirements.lists.pixel_sizes_um.size();
  std::vector<std::tuple<double, double, double, int>> others;
  others.reserve(c.design.feasible.size());
  for (const PairFigures& pair : c.design.feasible) {
    others.emplace_back(pair.shape.baseline_m, pair.shape.nearest_m, pair.shape.hfov_deg, pair.shape.width_px);
  }
  std::sort(others.begin(), others.end());
  others.erase(std::unique(others.begin(), others.end()), others.end());
  if (others.empty() || sizes < 2 || others.size() * sizes != c.design.feasible.size()) return;
  c.warn("pixel_size_never_binds", static_cast<double>(others.size()),
         fmt::format("pixel size never binds: each of the {} sizes leaves the same {} combinations of the rest", sizes,
                     others.size()));
}

void warn_of_baseline_limit(const Case& c) {
  PairRequirements without = c.requirements;
  without.smallest_baseline_m = 0;
  if (c.design.feasible.empty() || !(c.requirements.smallest_baseline_m > 0) ||
      count_feasible(without) != c.design.feasible.size()) {
    return;
  }
  const auto shortest =
      std::min_element(c.design.feasible.begin(), c.design.feasible.end(),
                       [](const auto& a, const auto& b) { return a.shape.baseline_m < b.shape.baseline_m; });
  c.warn("baseline_limit_never_binds", shortest->shape.baseline_m,
         fmt::format("the shortest baseline allowed, {} m, never binds: the other limits leave none below {} m",
                     c.requirements.smallest_baseline_m, shortest->shape.baseline_m));
}

void warn_of_stereo_angles(const Case& c) {
  const PairFigures* pair = c.design.chosen();
  if (!c.requirements.contradicting_stereo_angle_deg || !pair) return;
  PairRequirements other = c.requirements;
  other.largest_stereo_angle_deg = *c.requirements.contradicting_stereo_angle_deg;
  c.warn(
      "stereo_angle_limits_disagree", pair->stereo_angle_deg,
      fmt::format("two limits of the stereo angle are stated, {} deg and {} deg; the pair has {:.1f} deg. With {} deg "
                  "{} of {} combinations are feasible",
                  c.requirements.largest_stereo_angle_deg, other.largest_stereo_angle_deg, pair->stereo_angle_deg,
                  other.largest_stereo_angle_deg, count_feasible(other), c.design.combinations));
}

void warn_of_rounding(const Case& c) {
  if (!(c.design.nearest_to_a_limit < kSame)) return;
  c.warn("on_a_limit", c.design.nearest_to_a_limit,
         "a combination lies on a limit to 1e-9; what lies on a limit is counted as inside");
}

// --- the published pair by itself ---

void warn_of_limits(const Case& c, const PairFigures& pair) {
  const PairRequirements& asked = c.requirements;
  if (pair.margins.stereo_angle_deg < -kSame) {
    c.warn("stereo_angle_large", pair.stereo_angle_deg,
           fmt::format("the published pair has a stereo angle of {:.1f} deg, at most {} deg are allowed",
                       pair.stereo_angle_deg, asked.largest_stereo_angle_deg));
  }
  if (pair.margins.search_percent < -kSame) {
    c.warn("search_large", pair.search_percent,
           fmt::format("the published pair searches {:.1f} % of the width, at most {} % are allowed",
                       pair.search_percent, asked.largest_search_percent));
  }
  if (pair.margins.baseline_m < -kSame) {
    c.warn("baseline_short", pair.shape.baseline_m,
           fmt::format("the published pair has a baseline of {} m, at least {} m are asked for", pair.shape.baseline_m,
                       asked.smallest_baseline_m));
  }
}

// How much less range there is than was asked for, and two ways out.
void warn_of_range(const Case& c, const PairFigures& pair) {
  if (pair.margins.range_m >= -kSame) return;
  const PairRequirements& asked = c.requirements;
  const double hfov_rad = pair.shape.hfov_deg * kRadiansPerDegree;
  const StereoShape shape{pair.shape.baseline_m, static_cast<double>(pair.shape.width_px), hfov_rad};
  const DepthAccuracy accuracy{asked.range_resolution_m, asked.disparity_accuracy_px};
  c.warn("range_short", pair.range_m,
         fmt::format("at c = {} px the {} m hold to {:.2f} m, not to {} m", asked.disparity_accuracy_px,
                     asked.range_resolution_m, pair.range_m, asked.range_m));
  const double needed_px = accuracy_for_reach_px(shape, asked.range_resolution_m, asked.range_m);
  c.warn("accuracy_needed", needed_px,
         fmt::format("{} m need disparities known to c = {:.2f} px", asked.range_m, needed_px));

  const double needed_width = width_for_reach_px(shape, accuracy, asked.range_m);
  std::vector<int> widths = asked.lists.widths_px;
  std::sort(widths.begin(), widths.end());
  const auto enough = std::lower_bound(widths.begin(), widths.end(), needed_width);
  std::string text = fmt::format("or an image {:.0f} px wide", std::ceil(needed_width));
  double reached_m = asked.range_m;
  if (enough != widths.end()) {
    reached_m = reach_m({shape.baseline_m, static_cast<double>(*enough), hfov_rad}, accuracy);
    text += fmt::format("; of the widths on offer {} px, which reach {:.2f} m", *enough, reached_m);
  }
  c.warn("width_needed", reached_m, text);
}

// The lowest row looks at ground nearer than what a match is looked for.
void warn_of_near_ground(const Case& c, const PairFigures& pair) {
  const double tilt_rad = pair.tilt_deg * kRadiansPerDegree;
  const double lowest_rad = std::min(tilt_rad + pair.vfov_deg / 2 * kRadiansPerDegree, std::numbers::pi / 2);
  const double nearest_m = c.requirements.height_m / std::sin(lowest_rad);
  if (nearest_m < pair.shape.nearest_m) {
    c.warn("nearest_row", nearest_m,
           fmt::format("the row nearest the rover sees ground {:.2f} m away, nearer than d_min = {} m", nearest_m,
                       pair.shape.nearest_m));
  }
  // How far down the sensor really sees, by its rows: depth along the optical axis of the lowest one.
  const double hfov_rad = pair.shape.hfov_deg * kRadiansPerDegree;
  const double vfov_rad = vertical_view_rad(hfov_rad, c.requirements.published_rows_per_column());
  const double depth_m = c.requirements.height_m * std::cos(vfov_rad / 2) / std::sin(tilt_rad + vfov_rad / 2);
  const StereoShape shape{pair.shape.baseline_m, static_cast<double>(pair.shape.width_px), hfov_rad};
  const double largest_px = disparity_px(shape, depth_m), searched_px = disparity_px(shape, pair.shape.nearest_m);
  if (largest_px > searched_px * (1 + kRounded)) {
    c.warn(
        "largest_disparity", largest_px,
        fmt::format("the lowest row has disparities up to about {:.0f} px (square pixels); d_min stands for {:.0f} px",
                    largest_px, searched_px));
  }
}

void warn_of_optics(const Case& c, const PairFigures& pair) {
  const PublishedPair& published = *c.requirements.published;
  const double hfov_rad = pair.shape.hfov_deg * kRadiansPerDegree;
  if (published.focal_length_mm && std::abs(*published.focal_length_mm / pair.focal_length_mm - 1) > kRounded) {
    c.warn("focal_length_misfit", pair.focal_length_mm,
           fmt::format("{} deg over {} px of {} um need a focal length of {:.2f} mm, {} mm is published",
                       pair.shape.hfov_deg, pair.shape.width_px, pair.shape.pixel_size_um, pair.focal_length_mm,
                       *published.focal_length_mm));
  }
  const double rows_per_column = c.requirements.published_rows_per_column();
  const double square_deg = vertical_view_rad(hfov_rad, rows_per_column) / kRadiansPerDegree;
  if (published.vfov_deg && std::abs(*published.vfov_deg / square_deg - 1) > kRounded) {
    c.warn("vertical_view_misfit", square_deg,
           fmt::format("square pixels {} deg wide are {:.1f} deg high, {} deg is published", pair.shape.hfov_deg,
                       square_deg, *published.vfov_deg));
  }
}

// --- the pans ---

void warn_of_azimuth(const Case& c, const PanFigures& pans) {
  const AzimuthSet asked = asked_azimuth(*c.requirements.pans);
  if (!pans.azimuth_far.covers(asked)) {
    const double seen_deg = pans.azimuth_far.width_deg();
    c.warn("azimuth_far", seen_deg,
           fmt::format("at the far edge the pans see {:.1f} of the {} deg asked for (one eye, corners of the top row): "
                       "{}",
                       seen_deg, asked.width_deg(), in_words(pans.azimuth_far)));
  }
  if (pans.azimuth_far_stereo.covers(asked)) return;
  const double seen_deg = pans.azimuth_far_stereo.width_deg();
  c.warn("azimuth_far_stereo", seen_deg,
         fmt::format("at the far edge both eyes see {:.1f} of the {} deg: {}", seen_deg, asked.width_deg(),
                     in_words(pans.azimuth_far_stereo)));
  const std::string where = pans.azimuth_held ? fmt::format("only from {:.2f} m to {:.2f} m", pans.azimuth_held->from_m,
                                                            pans.azimuth_held->to_m)
                                              : "at no distance";
  c.warn("azimuth_held_to", pans.azimuth_held ? pans.azimuth_held->to_m : 0,
         fmt::format("both eyes see all of the {} deg {}", asked.width_deg(), where));
}

void warn_of_overlap(const Case& c, const PanFigures& pans) {
  if (!pans.overlap) return;
  const double asked_percent = c.requirements.pans->smallest_overlap_percent, percent = pans.overlap->percent();
  if (percent < asked_percent - kSame) {
    c.warn("pan_overlap", percent,
           fmt::format("neighbouring pans {}{}, an overlap by {} % is asked for", in_words(*pans.overlap),
                       percent >= 0 ? " of the view" : "", asked_percent));
  }
  const auto at_far_edge = [&](const char* id, const char* who, const std::optional<PanOverlap>& far) {
    if (!far || !(far->percent() < percent - 1)) return;
    c.warn(id, far->percent(),
           fmt::format("neighbouring pans {} nominally, at the top row they {} ({}); an overlap by {} % is asked for",
                       in_words(*pans.overlap), in_words(*far), who, asked_percent));
  };
  at_far_edge("pan_overlap_far", "one eye", pans.far_overlap);
  at_far_edge("pan_overlap_far_stereo", "both eyes", pans.far_overlap_stereo);
}

void add_warnings(const Case& c) {
  warn_of_choice(c);
  warn_of_pixel_size(c);
  warn_of_baseline_limit(c);
  warn_of_stereo_angles(c);
  warn_of_rounding(c);
  if (!c.design.published) return;
  warn_of_limits(c, *c.design.published);
  warn_of_range(c, *c.design.published);
  warn_of_near_ground(c, *c.design.published);
  warn_of_optics(c, *c.design.published);
}

}  // namespace

std::vector<DesignWarning> find_design_warnings(const RigRequirements& requirements, const RigDesign& design) {
  std::vector<DesignWarning> warnings;
  const Case wide{"wide", requirements.wide, design.wide, warnings};
  add_warnings(wide);
  if (design.pans) {
    warn_of_azimuth(wide, *design.pans);
    warn_of_overlap(wide, *design.pans);
  }
  if (requirements.narrow && design.narrow) add_warnings({"narrow", *requirements.narrow, *design.narrow, warnings});
  if (design.view_overlap_m && !(*design.view_overlap_m > 0)) {
    wide.warn("views_apart", 0, "no ground is seen by both the wide and the narrow pair");
  }
  return warnings;
}

}  // namespace spartan
