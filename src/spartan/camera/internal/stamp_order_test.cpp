#include "spartan/camera/internal/stamp_order.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

namespace spartan::internal {
namespace {

std::vector<Stamp> stamps(const std::vector<std::int64_t>& ns) {
  std::vector<Stamp> made;
  made.reserve(ns.size());
  for (const std::int64_t n : ns) made.push_back({n});
  return made;
}

std::vector<int> reversed(const std::vector<std::int64_t>& ns) {
  const std::vector<bool> found = find_reversals(stamps(ns));
  return {found.begin(), found.end()};
}

TEST(Reversals, MarksASingleOutlierAlone) {
  EXPECT_EQ(reversed({}), std::vector<int>{});
  EXPECT_EQ(reversed({1, 2, 3}), (std::vector<int>{0, 0, 0}));
  EXPECT_EQ(reversed({1, 900, 2, 3}), (std::vector<int>{0, 1, 0, 0}));
  EXPECT_EQ(reversed({1, 2, 0, 3}), (std::vector<int>{0, 0, 1, 0}));
  EXPECT_EQ(reversed({5, 5, 6}), (std::vector<int>{0, 1, 0})) << "the same stamp twice";
  EXPECT_EQ(reversed({3, 2, 1}), (std::vector<int>{0, 1, 1})) << "of equally large sets the later stamps are marked";
}

// Length of the longest strictly increasing subsequence, by exhaustive search.
std::size_t longest_by_exhaustion(const std::vector<std::int64_t>& ns) {
  std::size_t best = 0;
  for (std::uint32_t chosen = 0; chosen < (1U << ns.size()); ++chosen) {
    std::size_t count = 0;
    std::int64_t last = INT64_MIN;
    bool rises = true;
    for (std::size_t i = 0; i < ns.size() && rises; ++i) {
      if ((chosen >> i & 1U) == 0) continue;
      rises = ns[i] > last;
      last = ns[i];
      ++count;
    }
    if (rises) best = std::max(best, count);
  }
  return best;
}

RC_GTEST_PROP(Reversals, TheRestIsALongestIncreasingSubsequence, ()) {
  const auto ns = *rc::gen::container<std::vector<std::int64_t>>(*rc::gen::inRange<std::size_t>(0, 10),
                                                                 rc::gen::inRange<std::int64_t>(0, 12));
  const std::vector<bool> gone = find_reversals(stamps(ns));
  RC_ASSERT(gone.size() == ns.size());
  std::vector<std::int64_t> kept;
  for (std::size_t i = 0; i < ns.size(); ++i)
    if (!gone[i]) kept.push_back(ns[i]);
  RC_ASSERT(std::adjacent_find(kept.begin(), kept.end(), std::greater_equal<>()) == kept.end());
  RC_ASSERT(kept.size() == longest_by_exhaustion(ns));
}

TEST(MatchStamps, PairsNearestStampsWithinTheTolerance) {
  const auto matches = match_stamps(stamps({0, 1000, 2000, 3000}), stamps({10, 2005, 2990, 5000}), 50e-9);
  ASSERT_EQ(matches.size(), 5u);
  EXPECT_EQ(matches[0].left, 0u);
  EXPECT_EQ(matches[0].right, 0u);
  EXPECT_EQ(matches[1].left, 1u);
  EXPECT_FALSE(matches[1].right);
  EXPECT_EQ(matches[2].right, 1u);
  EXPECT_EQ(matches[3].right, 2u);
  EXPECT_FALSE(matches[4].left);
  EXPECT_EQ(matches[4].right, 3u);
}

RC_GTEST_PROP(MatchStamps, HoldsEveryIndexOnceInOrder, ()) {
  const auto times = rc::gen::container<std::vector<std::int64_t>>(rc::gen::inRange<std::int64_t>(0, 2000));
  const std::vector<Stamp> left = stamps(*times), right = stamps(*times);
  constexpr std::int64_t kTolerance_ns = 40;
  std::vector<int> seen_left(left.size()), seen_right(right.size());
  Stamp last{INT64_MIN / 2};
  for (const StampMatch& match : match_stamps(left, right, kTolerance_ns * 1e-9)) {
    if (match.left) ++seen_left[*match.left];
    if (match.right) ++seen_right[*match.right];
    if (match.left && match.right) RC_ASSERT(std::abs(left[*match.left].ns - right[*match.right].ns) <= kTolerance_ns);
    const Stamp at = match.left ? left[*match.left] : right[*match.right];
    // Pairs are sorted up to the difference of their two stamps.
    RC_ASSERT(at.ns >= last.ns - kTolerance_ns);
    last = std::max(last, at);
  }
  RC_ASSERT(std::all_of(seen_left.begin(), seen_left.end(), [](int n) { return n == 1; }));
  RC_ASSERT(std::all_of(seen_right.begin(), seen_right.end(), [](int n) { return n == 1; }));
}

TEST(Steps, GapsAreLongerThanThreeMedianIntervals) {
  const StepReport report = report_steps(stamps({0, 100, 200, 300, 601, 700, 1000}));
  EXPECT_NEAR(report.median_s, 100e-9, 1e-15);
  EXPECT_EQ(report.gaps, 1) << "301 is a gap, 300 is not";
  EXPECT_NEAR(report.longest_gap_s, 301e-9, 1e-15);
  EXPECT_EQ(report_steps(stamps({5})).gaps, 0);
  EXPECT_EQ(report_steps({}).median_s, 0);
}

}  // namespace
}  // namespace spartan::internal
