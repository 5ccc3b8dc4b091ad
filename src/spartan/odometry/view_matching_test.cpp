#include "spartan/odometry/view_matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/numerics/median.h"
#include "spartan/rig/rig.h"
#include "spartan/testing/synthetic_world.h"

namespace spartan {
namespace {

const RectifiedStereo kViews{{320, 240}, 260.0, {159.5, 119.5}, 0.12};

testing::SyntheticFrame synthetic_frame() {
  const testing::SyntheticWorld world{testing::SyntheticWorldOptions()};
  const Pose tilted = Pose(exp_so3({0, 0.4, 0}), {0, 0, 0.5});
  return world.render(kViews, tilted * optical_from_forward().inverse(), 1);
}

// Corresponding points of a rectified pair lie in the same row, which the matching does not assume.
TEST(ViewMatching, FindsTheRowsOfARectifiedPairToATenthOfAPixel) {
  const auto pair = synthetic_frame();
  const auto matches = match_views(pair.left.view(), pair.right.view(), {}, ThreadPool(1));
  ASSERT_GT(matches.size(), 80u);
  std::vector<double> rows, disparities;
  for (const ViewMatch& match : matches) {
    rows.push_back(std::abs(match.left.y() - match.right.y()));
    disparities.push_back(match.left.x() - match.right.x());
  }
  EXPECT_LT(median(rows), 0.1);
  EXPECT_LE(std::count_if(rows.begin(), rows.end(), [](double r) { return r > 1; }), std::ssize(rows) / 10);
  EXPECT_GT(median(disparities), 5);
}

TEST(ViewMatching, IsIdenticalForAnyNumberOfThreads) {
  const auto pair = synthetic_frame();
  const auto one = match_views(pair.left.view(), pair.right.view(), {}, ThreadPool(1));
  const auto two = match_views(pair.left.view(), pair.right.view(), {}, ThreadPool(2));
  ASSERT_EQ(one.size(), two.size());
  for (std::size_t i = 0; i < one.size(); ++i) {
    EXPECT_EQ(one[i].left, two[i].left);
    EXPECT_EQ(one[i].right, two[i].right);
  }
}

TEST(ViewMatching, FindsNothingInAnEmptyImage) {
  const Image<std::uint8_t> empty(320, 240);
  EXPECT_TRUE(match_views(empty.view(), empty.view(), {}, ThreadPool(1)).empty());
}

}  // namespace
}  // namespace spartan
