#include "spartan/camera/internal/stamp_order.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace spartan::internal {
namespace {

constexpr double kGapFactor = 3;  // a gap is longer than this multiple of the median interval

std::vector<std::size_t> sorted_order(const std::vector<Stamp>& stamps) {
  std::vector<std::size_t> order(stamps.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return stamps[a] < stamps[b]; });
  return order;
}

double distance_s(Stamp a, Stamp b) {
  return std::abs(seconds_between(a, b));
}

}  // namespace

std::vector<bool> find_reversals(const std::vector<Stamp>& stamps) {
  // Longest increasing subsequence by patience sorting, from the back.
  // run[i]: length of the longest increasing subsequence that starts at i.
  // heads[k]: the largest stamp that can start a subsequence of k + 1 stamps; decreasing in k.
  std::vector<std::size_t> run(stamps.size());
  std::vector<Stamp> heads;
  for (std::size_t i = stamps.size(); i-- > 0;) {
    const auto place = std::lower_bound(heads.begin(), heads.end(), stamps[i], [](Stamp a, Stamp b) { return a > b; });
    run[i] = static_cast<std::size_t>(place - heads.begin()) + 1;
    if (place == heads.end()) {
      heads.push_back(stamps[i]);
    } else {
      *place = std::max(*place, stamps[i]);
    }
  }
  // Of all longest subsequences keep the earliest stamps: greedily take the first stamp that allows the full length.
  std::vector<bool> reversed(stamps.size(), true);
  std::size_t wanted = heads.size();
  std::optional<Stamp> last;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (run[i] != wanted || (last && stamps[i] <= *last)) continue;
    reversed[i] = false;
    last = stamps[i];
    --wanted;
  }
  return reversed;
}

std::vector<StampMatch> match_stamps(const std::vector<Stamp>& left, const std::vector<Stamp>& right,
                                     double tolerance_s) {
  const std::vector<std::size_t> lefts = sorted_order(left), rights = sorted_order(right);
  std::vector<StampMatch> matches;
  matches.reserve(std::max(left.size(), right.size()));
  std::size_t i = 0, j = 0;
  const auto take_left = [&] { matches.push_back({lefts[i++], std::nullopt}); };
  const auto take_right = [&] { matches.push_back({std::nullopt, rights[j++]}); };
  while (i < lefts.size() && j < rights.size()) {
    const Stamp l = left[lefts[i]], r = right[rights[j]];
    const double apart = distance_s(l, r);
    if (apart > tolerance_s) {
      l < r ? take_left() : take_right();
    } else if (i + 1 < lefts.size() && distance_s(left[lefts[i + 1]], r) < apart) {
      take_left();
    } else if (j + 1 < rights.size() && distance_s(l, right[rights[j + 1]]) < apart) {
      take_right();
    } else {
      matches.push_back({lefts[i++], rights[j++]});
    }
  }
  while (i < lefts.size()) take_left();
  while (j < rights.size()) take_right();
  return matches;
}

StepReport report_steps(const std::vector<Stamp>& stamps) {
  StepReport report;
  if (stamps.size() < 2) return report;
  std::vector<double> steps;
  steps.reserve(stamps.size() - 1);
  for (std::size_t i = 1; i < stamps.size(); ++i) steps.push_back(seconds_between(stamps[i - 1], stamps[i]));
  std::vector<double> sorted = steps;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>((sorted.size() - 1) / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  report.median_s = *middle;
  for (const double step : steps) {
    if (step <= kGapFactor * report.median_s) continue;
    ++report.gaps;
    report.longest_gap_s = std::max(report.longest_gap_s, step);
  }
  return report;
}

}  // namespace spartan::internal
