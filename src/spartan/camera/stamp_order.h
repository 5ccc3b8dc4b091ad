// What the stamps of a recording say: which images belong together, which run backwards, where time is missing.
#pragma once

#include <optional>
#include <vector>

#include "spartan/core/time.h"

namespace spartan {

/// The fewest stamps that must go so that the rest increases strictly; of equally many the later ones go. So one
/// stamp far in the future costs itself and not all that follow it. True: goes. O(n log n).
std::vector<bool> find_reversals(const std::vector<Stamp>& stamps);

/// A left and a right stamp that belong together (indices into the lists), or one without partner.
struct StampMatch {
  std::optional<std::size_t> left, right;
};

/// Matches each left stamp with the right one nearest to it, one to one, where the two are the nearest of each other
/// and at most `tolerance_s` apart. The lists may be in any order. The result holds every index once, in the order of
/// time; where stamps are equal, in the order of the lists.
std::vector<StampMatch> match_stamps(const std::vector<Stamp>& left, const std::vector<Stamp>& right,
                                     double tolerance_s);

/// Steps of increasing stamps.
struct StepReport {
  double median_s = 0;  ///< the lower one of an even number; 0 where there is no step
  int gaps = 0;         ///< steps longer than three times the median
  double longest_gap_s = 0;
};
StepReport report_steps(const std::vector<Stamp>& stamps);

}  // namespace spartan
