// The rig designer: which of the pairs on offer meet the requirements, the best of them, and what a published choice is
// worth beside them.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "spartan/rig/design/design_warning.h"
#include "spartan/rig/design/ground_view.h"
#include "spartan/rig/design/pan_view.h"
#include "spartan/rig/design/requirements.h"

namespace spartan {

/// How far a pair stands inside of each limit; negative: outside. What is not asked for is NaN.
struct PairMargins {
  double range_m = 0, stereo_angle_deg = 0, search_percent = 0, baseline_m = 0;
  double pan_overlap_percent = 0;
};

/// One pair with everything that follows from its shape (docs/math/rig_design.md).
struct PairFigures {
  PairShape shape;
  double range_m = 0;          ///< up to where the asked resolution holds
  double focal_length_mm = 0;  ///< by width, pixel size and view
  double stereo_angle_deg = 0;
  double search_percent = 0;
  double pan_overlap_percent = 0;  ///< of neighbouring pans, nominal: of the view's angle; NaN without pans
  double vfov_deg = 0, tilt_deg = 0;
  double view_near_m = 0, view_far_m = 0;  ///< ground in the middle column
  PairMargins margins;
  bool feasible = false;          ///< range, stereo angle, search range and baseline are within their limits
  bool with_pan_overlap = false;  ///< and so is the overlap of the pans; false without pans
};

struct PairDesign {
  std::size_t combinations = 0;
  std::vector<PairFigures> feasible;  ///< the best first
  /// Of them, with enough overlap of the pans; none where there are no pans.
  std::optional<std::size_t> with_pan_overlap_count;
  std::size_t equally_good = 0;  ///< how many of them the order cannot tell from the best, itself counted
  std::optional<PairFigures> best_with_pan_overlap;
  std::optional<PairFigures> published;
  /// How near the closest figure of any combination is to its limit, as a part of that limit: far above 10⁻⁹, rounding
  /// decides nothing.
  double nearest_to_a_limit = std::numeric_limits<double>::infinity();
  bool published_on_offer = false;  ///< it is one of the combinations

  const PairFigures* best() const { return feasible.empty() ? nullptr : &feasible.front(); }
  /// What pictures and figures of the ground are of: the published pair, else the best that looks around without gaps,
  /// else the best; null where there is none.
  const PairFigures* chosen() const;
};

struct RigDesign {
  PairDesign wide;
  std::optional<PairDesign> narrow;
  std::optional<PanFigures> pans;        ///< of the chosen wide pair
  std::optional<double> view_overlap_m;  ///< ground that both chosen pairs see, middle column
  std::vector<DesignWarning> warnings;
};

RigDesign design_rig(const RigRequirements& requirements);

/// The figures of one shape. Its tilt is the largest multiple of the step with which the top row still reaches the
/// range.
PairFigures figures_of(const PairShape& shape, const PairRequirements& requirements);
/// The same for the published pair, with its own rows, view and tilt where it states them. There must be one.
PairFigures published_figures(const PairRequirements& requirements);

/// How many of the combinations are feasible.
std::size_t count_feasible(const PairRequirements& requirements);

/// The ground that a pair sees.
GroundView ground_view(const PairFigures& pair, const PairRequirements& requirements);

}  // namespace spartan
