// Analysis of time stamps: pairing of left and right images, reversed stamps, gaps.
#pragma once

#include <optional>
#include <vector>

#include "spartan/core/time.h"

namespace spartan::internal {

/// Marks (true) the smallest set of stamps without which the rest strictly increases: the complement of a longest
/// increasing subsequence. Among sets of equal size the later stamps are marked. A single stamp far in the future is
/// thus marked alone, and not all stamps after it. O(n log n).
std::vector<bool> find_reversals(const std::vector<Stamp>& stamps);

/// Indices of a left and a right stamp that belong together, or of one stamp without a partner.
struct StampMatch {
  std::optional<std::size_t> left, right;
};

/// Pairs left and right stamps that are mutual nearest neighbours at most `tolerance_s` apart. The lists may be
/// unsorted. The result holds every index exactly once, sorted by time; equal stamps keep their order in the lists.
std::vector<StampMatch> match_stamps(const std::vector<Stamp>& left, const std::vector<Stamp>& right,
                                     double tolerance_s);

/// Statistics of the intervals between increasing stamps.
struct StepReport {
  double median_s = 0;       ///< lower median; 0 without an interval
  int gaps = 0;              ///< intervals longer than three times the median
  double longest_gap_s = 0;  ///< 0 without a gap
};
StepReport report_steps(const std::vector<Stamp>& stamps);

}  // namespace spartan::internal
