#include "spartan/camera/stamp_order.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace spartan {
namespace {

using ::testing::ElementsAre;

std::vector<Stamp> stamps(const std::vector<int>& values) {
  std::vector<Stamp> result;
  for (const int value : values) result.push_back({value * 1'000'000LL});
  return result;
}
std::vector<int> small_numbers(std::size_t most, int below) {
  const auto size = *rc::gen::inRange<std::size_t>(0, most + 1);
  return *rc::gen::container<std::vector<int>>(size, rc::gen::inRange(0, below));
}

TEST(FindReversals, OneStampFarInTheFutureCostsItselfOnly) {
  EXPECT_THAT(find_reversals(stamps({0, 1, 900, 2, 3})), ElementsAre(false, false, true, false, false));
  EXPECT_THAT(find_reversals(stamps({5, 0, 1, 2})), ElementsAre(true, false, false, false));
  EXPECT_THAT(find_reversals(stamps({0, 1, 1, 2})), ElementsAre(false, false, true, false)) << "equal: the later goes";
  EXPECT_THAT(find_reversals(stamps({2, 1})), ElementsAre(false, true));
  EXPECT_TRUE(find_reversals({}).empty());
}

// The longest increasing subsequence by trying every subset is what no cleverness can beat.
RC_GTEST_PROP(FindReversals, DropsTheFewest, ()) {
  const std::vector<Stamp> given = stamps(small_numbers(10, 8));
  const std::vector<bool> reversed = find_reversals(given);
  RC_ASSERT(reversed.size() == given.size());
  std::vector<Stamp> kept;
  for (std::size_t i = 0; i < given.size(); ++i) {
    if (!reversed[i]) kept.push_back(given[i]);
  }
  const auto increases = [](const std::vector<Stamp>& list) {
    return std::adjacent_find(list.begin(), list.end(), [](Stamp a, Stamp b) { return a >= b; }) == list.end();
  };
  RC_ASSERT(increases(kept));
  std::size_t longest = 0;
  for (unsigned subset = 0; subset < (1U << given.size()); ++subset) {
    std::vector<Stamp> tried;
    for (std::size_t i = 0; i < given.size(); ++i) {
      if ((subset >> i & 1U) != 0) tried.push_back(given[i]);
    }
    if (increases(tried)) longest = std::max(longest, tried.size());
  }
  RC_ASSERT(kept.size() == longest);
}

TEST(MatchStamps, TakesTheNearestWithinTheTolerance) {
  const auto matches = match_stamps(stamps({0, 100, 200, 300}), stamps({3, 104, 296, 400}), 0.005);
  std::vector<std::pair<int, int>> found;
  for (const StampMatch& m : matches) {
    found.emplace_back(m.left ? static_cast<int>(*m.left) : -1, m.right ? static_cast<int>(*m.right) : -1);
  }
  using P = std::pair<int, int>;
  EXPECT_THAT(found, ElementsAre(P(0, 0), P(1, 1), P(2, -1), P(3, 2), P(-1, 3)));
}

TEST(MatchStamps, AStampGoesToItsNearestPartnerNotToTheFirst) {
  const auto matches = match_stamps(stamps({0, 4}), stamps({3}), 0.005);
  ASSERT_EQ(matches.size(), 2U);
  EXPECT_FALSE(matches[0].right);
  EXPECT_EQ(matches[1].left, 1U);
  EXPECT_EQ(matches[1].right, 0U);
}

RC_GTEST_PROP(MatchStamps, HoldsEveryIndexOnceAndOnlyNearPairs, ()) {
  const std::vector<Stamp> left = stamps(small_numbers(12, 60)), right = stamps(small_numbers(12, 60));
  const double tolerance = 0.005;
  std::vector<int> lefts(left.size()), rights(right.size());
  Stamp before{std::numeric_limits<std::int64_t>::min()};
  const auto matches = match_stamps(left, right, tolerance);
  for (const StampMatch& m : matches) {
    RC_ASSERT(m.left || m.right);
    if (m.left) ++lefts[*m.left];
    if (m.right) ++rights[*m.right];
    if (m.left && m.right) RC_ASSERT(std::abs(seconds_between(left[*m.left], right[*m.right])) <= tolerance);
    const Stamp first =
        m.left && m.right ? std::max(left[*m.left], right[*m.right]) : (m.left ? left[*m.left] : right[*m.right]);
    RC_ASSERT(first >= before);
    before = m.left && m.right ? std::min(left[*m.left], right[*m.right]) : first;
  }
  RC_ASSERT(std::all_of(lefts.begin(), lefts.end(), [](int n) { return n == 1; }));
  RC_ASSERT(std::all_of(rights.begin(), rights.end(), [](int n) { return n == 1; }));
  // A single candidate on both sides within the tolerance is always taken.
  for (std::size_t i = 0; i < left.size(); ++i) {
    for (std::size_t j = 0; j < right.size(); ++j) {
      const auto near = [&](Stamp a, Stamp b) { return std::abs(seconds_between(a, b)) <= tolerance; };
      const bool alone = near(left[i], right[j]) &&
                         std::count_if(left.begin(), left.end(), [&](Stamp s) { return near(s, right[j]); }) == 1 &&
                         std::count_if(right.begin(), right.end(), [&](Stamp s) { return near(left[i], s); }) == 1;
      if (!alone) continue;
      RC_ASSERT(std::any_of(matches.begin(), matches.end(),
                            [&](const StampMatch& m) { return m.left == i && m.right == j; }));
    }
  }
}

TEST(ReportSteps, CountsStepsAboveThreeMedians) {
  const StepReport report = report_steps(stamps({0, 100, 200, 500, 600, 1000, 1100}));
  EXPECT_DOUBLE_EQ(report.median_s, 0.1);
  EXPECT_EQ(report.gaps, 1) << "0.3 s are three medians, not more";
  EXPECT_DOUBLE_EQ(report.longest_gap_s, 0.4);
  EXPECT_EQ(report_steps(stamps({5})).gaps, 0);
  EXPECT_EQ(report_steps({}).median_s, 0);
}

TEST(ReportSteps, SlowRecordingsHaveNoGaps) {
  const StepReport report = report_steps(stamps({0, 2000, 4000, 6100, 8000}));
  EXPECT_DOUBLE_EQ(report.median_s, 2.0);
  EXPECT_EQ(report.gaps, 0);
  EXPECT_EQ(report.longest_gap_s, 0);
}

}  // namespace
}  // namespace spartan
