// Rig design: exhaustive search for the stereo pairs that meet requirements, and evaluation of a published pair.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "spartan/rig_design/design_warning.h"
#include "spartan/rig_design/ground_view.h"
#include "spartan/rig_design/pan_coverage.h"
#include "spartan/rig_design/requirements.h"

namespace spartan {

/// Margin of a pair to each limit; negative: violated. NaN where nothing is required.
struct PairMargins {
  double range_m = 0, stereo_angle_deg = 0, search_percent = 0, baseline_m = 0;
  double pan_overlap_percent = 0;
};

/// One pair with all values derived from its parameters (docs/math/rig_design.md).
struct PairMetrics {
  PairParameters parameters;
  double range_m = 0;          ///< range up to which the required resolution is met
  double focal_length_mm = 0;  ///< from width, pixel size and field of view
  double stereo_angle_deg = 0;
  double search_percent = 0;
  double pan_overlap_percent = 0;  ///< nominal, of neighbouring pans, share of the field of view; NaN without pans
  double vfov_deg = 0, tilt_deg = 0;
  double view_near_m = 0, view_far_m = 0;  ///< visible ground in the middle column, from the foot of the camera
  PairMargins margins;
  bool feasible = false;          ///< range, stereo angle, search range and baseline are within their limits
  bool with_pan_overlap = false;  ///< feasible, and the overlap of the pans is sufficient; false without pans
};

/// Result of the search for one pair.
struct PairDesign {
  std::size_t combinations = 0;
  std::vector<PairMetrics> feasible;  ///< ordered, best first
  /// How many of them have sufficient overlap of the pans; none where there are no pans.
  std::optional<std::size_t> with_pan_overlap_count;
  std::size_t equally_good = 0;  ///< how many of them are equal to the best by all criteria, including itself
  std::optional<PairMetrics> best_with_pan_overlap;
  std::optional<PairMetrics> published;
  /// Smallest distance of any value of any combination from its limit, relative to that limit. Far above 10⁻⁹: rounding
  /// has no influence on feasibility.
  double smallest_limit_distance = std::numeric_limits<double>::infinity();
  bool published_is_candidate = false;  ///< whether the published pair is one of the combinations

  const PairMetrics* best() const { return feasible.empty() ? nullptr : &feasible.front(); }
  /// The pair for which ground coverage is computed and drawn: the published pair, else the best with sufficient
  /// overlap of the pans, else the best; null where there is none.
  const PairMetrics* selected() const;
};

/// Result of design_rig().
struct RigDesign {
  PairDesign wide;
  std::optional<PairDesign> narrow;
  std::optional<PanCoverage> pans;       ///< coverage of the selected wide pair
  std::optional<double> view_overlap_m;  ///< length of ground visible to both selected pairs, middle column
  std::vector<DesignWarning> warnings;
};

/// Searches all combinations of the wide and of the narrow pair, computes ground coverage, and collects warnings.
RigDesign design_rig(const RigRequirements& requirements);

/// Evaluates one set of parameters. Its tilt is the largest multiple of tilt_step_deg at which the top row still
/// reaches the required range.
PairMetrics metrics_of(const PairParameters& parameters, const PairRequirements& requirements);
/// Evaluates the published pair, which must exist, with its own rows, field of view and tilt where they are given.
PairMetrics published_metrics(const PairRequirements& requirements);

/// Number of feasible combinations.
std::size_t count_feasible(const PairRequirements& requirements);

/// The ground view of a pair at its tilt.
GroundView ground_view(const PairMetrics& pair, const PairRequirements& requirements);

}  // namespace spartan
