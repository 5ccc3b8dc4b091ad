#include "spartan/eval/internal/association.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <set>

namespace spartan::internal {
namespace {

Trajectory at_seconds(const std::vector<double>& seconds) {
  Trajectory trajectory;
  for (const double s : seconds) trajectory.push_back({Stamp::from_seconds(s), Pose::from_translation({s, 0, 0})});
  return trajectory;
}

TEST(Association, TakesTheNearestInTime) {
  const auto pairs = associate(at_seconds({0.0, 0.1, 0.205, 0.5}), at_seconds({0.01, 0.09, 0.11, 0.2, 0.3}), 0.02);
  ASSERT_TRUE(pairs);
  ASSERT_EQ(pairs->truth.size(), 3U) << "0.5 s has no truth pose within the limit";
  EXPECT_EQ(pairs->truth[0].stamp, Stamp::from_seconds(0.01));
  EXPECT_EQ(pairs->truth[1].stamp, Stamp::from_seconds(0.09)) << "the earlier one of two equally near";
  EXPECT_EQ(pairs->truth[2].stamp, Stamp::from_seconds(0.2));
  EXPECT_EQ(pairs->estimate[2].stamp, Stamp::from_seconds(0.205));
}

TEST(Association, ATruthPoseIsUsedOnce) {
  const auto pairs = associate(at_seconds({0.0, 0.01, 0.02, 0.03}), at_seconds({0.012, 0.5}), 0.02);
  ASSERT_TRUE(pairs);
  ASSERT_EQ(pairs->estimate.size(), 1U);
  EXPECT_EQ(pairs->estimate[0].stamp, Stamp::from_seconds(0.01));
}

TEST(Association, FailsWithoutAnyPair) {
  for (const auto& pairs : {associate(at_seconds({0, 1}), at_seconds({5, 6}), 0.02), associate({}, at_seconds({1}), 1),
                            associate(at_seconds({1}), {}, 1)}) {
    ASSERT_FALSE(pairs);
    EXPECT_EQ(pairs.error().code, ErrorCode::input);
  }
}

// Against a brute-force search over all pairs.
RC_GTEST_PROP(Association, AgreesWithBruteForce, ()) {
  const auto stamps = [] {
    const auto drawn = *rc::gen::container<std::set<int>>(rc::gen::inRange(0, 300));
    Trajectory trajectory;
    for (const int ms : drawn) trajectory.push_back({Stamp{ms * 1'000'000LL}, {}});
    return trajectory;
  };
  const Trajectory estimate = stamps(), truth = stamps();
  std::vector<std::pair<std::int64_t, std::int64_t>> expected;  // stamps of truth and estimate
  for (const auto& e : estimate) {
    const StampedPose* best = nullptr;
    for (const auto& t : truth) {
      if (!best || std::abs(t.stamp.ns - e.stamp.ns) < std::abs(best->stamp.ns - e.stamp.ns)) best = &t;
    }
    if (!best || std::abs(best->stamp.ns - e.stamp.ns) > 5'000'000) continue;
    if (!expected.empty() && expected.back().first == best->stamp.ns) {
      const auto before = std::abs(expected.back().second - best->stamp.ns);
      if (std::abs(e.stamp.ns - best->stamp.ns) < before) expected.back().second = e.stamp.ns;
      continue;
    }
    expected.emplace_back(best->stamp.ns, e.stamp.ns);
  }
  const auto pairs = associate(estimate, truth, 0.005);
  RC_ASSERT(pairs.has_value() == !expected.empty());
  if (!pairs) return;
  RC_ASSERT(pairs->truth.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    RC_ASSERT(pairs->truth[i].stamp.ns == expected[i].first);
    RC_ASSERT(pairs->estimate[i].stamp.ns == expected[i].second);
  }
}

}  // namespace
}  // namespace spartan::internal
