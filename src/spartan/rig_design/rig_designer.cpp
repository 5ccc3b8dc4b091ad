#include "spartan/rig_design/rig_designer.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "spartan/core/pose.h"
#include "spartan/rig_design/internal/stereo_relations.h"

namespace spartan {

using namespace internal;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
// Tolerance of limits and of equality: more than rounding errors, less than any relevant difference.
constexpr double kTolerance = 1e-9;

bool holds(double margin) {
  return margin >= -kTolerance;
}

DepthAccuracy accuracy_of(const PairRequirements& requirements) {
  return {requirements.range_resolution_m, requirements.disparity_accuracy_px};
}

double tilt_for_range_deg(double vfov_deg, const PairRequirements& requirements) {
  const double reaching_deg =
      tilt_to_reach_rad(requirements.height_m, requirements.range_m, vfov_deg * kRadiansPerDegree) / kRadiansPerDegree;
  const double steps = std::floor(reaching_deg / requirements.tilt_step_deg + kTolerance);
  return std::min(90.0, std::round(steps * requirements.tilt_step_deg * 1e9) / 1e9);
}

// Everything except field of view and tilt.
PairMetrics stereo_figures(const PairParameters& parameters, const PairRequirements& requirements) {
  const double hfov_rad = parameters.hfov_deg * kRadiansPerDegree;
  const double angle_rad = stereo_angle_rad(parameters.baseline_m, parameters.nearest_m);
  PairMetrics pair;
  pair.parameters = parameters;
  pair.range_m = max_range_m({parameters.baseline_m, static_cast<double>(parameters.width_px), hfov_rad},
                             accuracy_of(requirements));
  pair.focal_length_mm = focal_length_mm(parameters.pixel_size_um, parameters.width_px, hfov_rad);
  pair.stereo_angle_deg = angle_rad / kRadiansPerDegree;
  pair.search_percent = search_percent(angle_rad, hfov_rad);
  const bool pans = requirements.pans && requirements.pans->angles_deg.size() > 1;
  pair.pan_overlap_percent =
      pans ? overlap_percent(hfov_rad, requirements.pans->widest_step_deg() * kRadiansPerDegree) : kNan;
  pair.margins = {pair.range_m - requirements.range_m, requirements.largest_stereo_angle_deg - pair.stereo_angle_deg,
                  requirements.largest_search_percent - pair.search_percent,
                  parameters.baseline_m - requirements.smallest_baseline_m,
                  pans ? pair.pan_overlap_percent - requirements.pans->smallest_overlap_percent : kNan};
  const PairMargins& margins = pair.margins;
  pair.feasible = holds(margins.range_m) && holds(margins.stereo_angle_deg) && holds(margins.search_percent) &&
                  holds(margins.baseline_m);
  pair.with_pan_overlap = pair.feasible && pans && holds(margins.pan_overlap_percent);
  return pair;
}

void add_view(PairMetrics& pair, double vfov_deg, double tilt_deg, const PairRequirements& requirements) {
  pair.vfov_deg = vfov_deg;
  pair.tilt_deg = tilt_deg;
  const GroundView view = ground_view(pair, requirements);
  pair.view_near_m = near_edge_m(view);
  pair.view_far_m = far_edge_m(view);
}

double square_pixel_view_deg(double hfov_deg, double rows_per_column) {
  return vertical_view_rad(hfov_deg * kRadiansPerDegree, rows_per_column) / kRadiansPerDegree;
}

// Calls visit(shape) for every combination, in the order of the lists.
template <class Visit>
void for_every_shape(const CandidateLists& lists, const Visit& visit) {
  for (const double baseline_m : lists.baselines_m) {
    for (const double nearest_m : lists.nearest_m) {
      for (const double hfov_deg : lists.hfov_deg) {
        for (const double pixel_size_um : lists.pixel_sizes_um) {
          for (const int width_px : lists.widths_px) {
            visit(PairParameters{baseline_m, nearest_m, hfov_deg, pixel_size_um, width_px});
          }
        }
      }
    }
  }
}

// Smallest distance of a computed value from its limit, relative to that limit. The baseline is given, not computed.
double distance_to_limits(const PairMetrics& pair, const PairRequirements& requirements) {
  const PairMargins& margins = pair.margins;
  double nearest = std::min({std::abs(margins.range_m) / requirements.range_m,
                             std::abs(margins.stereo_angle_deg) / requirements.largest_stereo_angle_deg,
                             std::abs(margins.search_percent) / requirements.largest_search_percent});
  if (!std::isnan(margins.pan_overlap_percent))
    nearest = std::min(nearest, std::abs(margins.pan_overlap_percent) / 100);
  return nearest;
}

// The largest violation of a limit, relative to that limit; 0 where all limits are met.
double violation(const PairMetrics& pair, const PairRequirements& requirements) {
  const PairMargins& margins = pair.margins;
  const auto relative = [](double margin, double limit) { return holds(margin) ? 0 : -margin / limit; };
  return std::max({relative(margins.range_m, requirements.range_m),
                   relative(margins.stereo_angle_deg, requirements.largest_stereo_angle_deg),
                   relative(margins.search_percent, requirements.largest_search_percent),
                   relative(margins.baseline_m, requirements.smallest_baseline_m)});
}

void search(const PairRequirements& requirements, PairDesign& design) {
  double least = std::numeric_limits<double>::infinity();
  for_every_shape(requirements.lists, [&](const PairParameters& parameters) {
    const PairMetrics pair = stereo_figures(parameters, requirements);
    design.smallest_limit_distance = std::min(design.smallest_limit_distance, distance_to_limits(pair, requirements));
    design.meeting.range += holds(pair.margins.range_m) ? 1 : 0;
    design.meeting.stereo_angle += holds(pair.margins.stereo_angle_deg) ? 1 : 0;
    design.meeting.search += holds(pair.margins.search_percent) ? 1 : 0;
    design.meeting.baseline += holds(pair.margins.baseline_m) ? 1 : 0;
    if (pair.feasible) {
      design.feasible.push_back(metrics_of(parameters, requirements));
    } else if (const double worst = violation(pair, requirements); design.feasible.empty() && worst < least) {
      least = worst;
      design.nearest = metrics_of(parameters, requirements);
    }
  });
  if (!design.feasible.empty()) design.nearest.reset();
}

double value_of(const PairMetrics& pair, DesignCriterion criterion) {
  switch (criterion) {
    case DesignCriterion::range_margin:
      return pair.margins.range_m;
    case DesignCriterion::pan_overlap:
      return std::isnan(pair.pan_overlap_percent) ? 0 : pair.pan_overlap_percent;
    case DesignCriterion::shorter_baseline:
      return -pair.parameters.baseline_m;
  }
  return 0;
}

// The rank of each pair by one criterion, 0 for the best. Values within the tolerance of their neighbour in sorted
// order share a rank.
std::vector<std::uint32_t> ranks_by(DesignCriterion criterion, const std::vector<PairMetrics>& pairs) {
  std::vector<std::pair<double, std::uint32_t>> descending;
  descending.reserve(pairs.size());
  for (const PairMetrics& pair : pairs) {
    descending.emplace_back(value_of(pair, criterion), static_cast<std::uint32_t>(descending.size()));
  }
  std::sort(descending.begin(), descending.end(), std::greater<>());
  std::vector<std::uint32_t> ranks(pairs.size());
  std::uint32_t rank = 0;
  for (std::size_t i = 0; i < descending.size(); ++i) {
    if (i > 0 && descending[i - 1].first - descending[i].first >= kTolerance) ++rank;
    ranks[descending[i].second] = rank;
  }
  return ranks;
}

// Moves to each position i the pair at from[i], in place.
void permute(std::vector<PairMetrics>& pairs, std::vector<std::uint32_t> from) {
  for (std::uint32_t start = 0; start < from.size(); ++start) {
    const PairMetrics first = pairs[start];
    std::uint32_t position = start;
    while (from[position] != start) {
      pairs[position] = pairs[from[position]];
      position = std::exchange(from[position], position);
    }
    pairs[position] = first;
    from[position] = position;
  }
}

// Best first; equal pairs stay in the order of the lists.
void sort_by_criteria(PairDesign& design, const std::vector<DesignCriterion>& order) {
  std::vector<std::vector<std::uint32_t>> ranks;
  ranks.reserve(order.size());
  for (const DesignCriterion criterion : order) ranks.push_back(ranks_by(criterion, design.feasible));
  const auto better = [&](std::uint32_t a, std::uint32_t b) {
    for (const auto& by_criterion : ranks) {
      if (by_criterion[a] != by_criterion[b]) return by_criterion[a] < by_criterion[b];
    }
    return false;
  };
  std::vector<std::uint32_t> sorted(design.feasible.size());
  std::iota(sorted.begin(), sorted.end(), 0u);
  std::stable_sort(sorted.begin(), sorted.end(), better);
  design.equally_good = static_cast<std::size_t>(
      std::count_if(sorted.begin(), sorted.end(), [&](std::uint32_t pair) { return !better(sorted.front(), pair); }));
  permute(design.feasible, std::move(sorted));
}

template <class Value>
bool holds_value(const std::vector<Value>& list, Value value) {
  return std::any_of(list.begin(), list.end(), [&](Value listed) { return std::abs(listed - value) < kTolerance; });
}

bool is_candidate(const PairParameters& parameters, const CandidateLists& lists) {
  return holds_value(lists.baselines_m, parameters.baseline_m) && holds_value(lists.nearest_m, parameters.nearest_m) &&
         holds_value(lists.hfov_deg, parameters.hfov_deg) &&
         holds_value(lists.pixel_sizes_um, parameters.pixel_size_um) &&
         holds_value(lists.widths_px, parameters.width_px);
}

PairDesign design_pair(const PairRequirements& requirements) {
  PairDesign design;
  design.name = requirements.name;
  design.pans_required = requirements.pans.has_value();
  design.combinations = requirements.lists.combinations();
  search(requirements, design);
  sort_by_criteria(design, requirements.order);
  if (requirements.pans && requirements.pans->angles_deg.size() > 1) {
    const auto overlaps = [](const PairMetrics& pair) { return pair.with_pan_overlap; };
    design.with_pan_overlap_count = std::count_if(design.feasible.begin(), design.feasible.end(), overlaps);
    const auto best = std::find_if(design.feasible.begin(), design.feasible.end(), overlaps);
    if (best != design.feasible.end()) design.best_with_pan_overlap = *best;
  }
  if (requirements.published) {
    design.published = published_metrics(requirements);
    design.published_is_candidate = is_candidate(requirements.published->parameters, requirements.lists);
  }
  return design;
}

// Whether both cameras of the pair see common ground.
bool shares_ground(const PairMetrics& pair, const PairRequirements& requirements) {
  return !common_footprint(ground_view(pair, requirements), 0).empty();
}

// The ground in the middle column that all pairs see; none for a single pair, or where a pair has no selection.
std::optional<double> view_overlap_m(const RigRequirements& requirements, const RigDesign& design) {
  if (design.pairs.size() < 2) return std::nullopt;
  double from_m = -std::numeric_limits<double>::infinity(), to_m = std::numeric_limits<double>::infinity();
  bool all_see = true;
  for (std::size_t i = 0; i < design.pairs.size(); ++i) {
    const PairMetrics* const pair = design.pairs[i].selected();
    if (pair == nullptr) return std::nullopt;
    all_see = all_see && shares_ground(*pair, requirements.pairs[i]);
    from_m = std::max(from_m, pair->view_near_m);
    to_m = std::min(to_m, pair->view_far_m);
  }
  return all_see ? std::max(0.0, to_m - from_m) : 0;
}

}  // namespace

const PairMetrics* PairDesign::selected() const {
  if (published) return &*published;
  return best_with_pan_overlap ? &*best_with_pan_overlap : best();
}

PairMetrics metrics_of(const PairParameters& parameters, const PairRequirements& requirements) {
  PairMetrics pair = stereo_figures(parameters, requirements);
  const double vfov_deg = square_pixel_view_deg(parameters.hfov_deg, requirements.rows_per_column);
  add_view(pair, vfov_deg, tilt_for_range_deg(vfov_deg, requirements), requirements);
  return pair;
}

PairMetrics published_metrics(const PairRequirements& requirements) {
  const PublishedPair& published = requirements.published.value();
  PairMetrics pair = stereo_figures(published.parameters, requirements);
  const double vfov_deg = published.vfov_deg.value_or(
      square_pixel_view_deg(published.parameters.hfov_deg, requirements.published_rows_per_column()));
  add_view(pair, vfov_deg, published.tilt_deg.value_or(tilt_for_range_deg(vfov_deg, requirements)), requirements);
  return pair;
}

GroundView ground_view(const PairMetrics& pair, const PairRequirements& requirements) {
  return {requirements.height_m, pair.tilt_deg * kRadiansPerDegree, pair.parameters.hfov_deg * kRadiansPerDegree,
          pair.vfov_deg * kRadiansPerDegree, pair.parameters.baseline_m};
}

std::size_t count_feasible(const PairRequirements& requirements) {
  std::size_t count = 0;
  for_every_shape(requirements.lists, [&](const PairParameters& parameters) {
    count += stereo_figures(parameters, requirements).feasible ? 1 : 0;
  });
  return count;
}

RigDesign design_rig(const RigRequirements& requirements) {
  RigDesign design;
  for (const PairRequirements& pair : requirements.pairs) design.pairs.push_back(design_pair(pair));
  const PairRequirements& panned = requirements.pairs[requirements.panned()];
  const PairMetrics* const selected = design.pairs[requirements.panned()].selected();
  if (selected && panned.pans) design.pans = pan_coverage(ground_view(*selected, panned), *panned.pans);
  design.view_overlap_m = view_overlap_m(requirements, design);
  design.warnings = find_design_warnings(requirements, design);
  return design;
}

}  // namespace spartan
