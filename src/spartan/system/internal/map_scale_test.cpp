#include "spartan/system/internal/map_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace spartan::internal {
namespace {

using ::testing::HasSubstr;

PairOverGround pair_over_ground(double focal_px, double baseline_m, ImageSize size, double tilt_deg,
                                std::optional<double> height_m) {
  PairOverGround pair;
  pair.geometry = {size, focal_px, {0.5 * (size.width - 1), 0.5 * (size.height - 1)}, baseline_m};
  const double tilt = tilt_deg * std::numbers::pi / 180;
  pair.up_in_left = {0, -std::cos(tilt), -std::sin(tilt)};
  pair.height_m = height_m;
  return pair;
}

TEST(MapScale, FollowsHeightAndRangeOfTheRig) {
  const PairOverGround car = pair_over_ground(707.09, 0.5372, {1226, 370}, 1, 1.68);
  const PairOverGround mast = pair_over_ground(1200.9, 0.2, {1120, 1120}, 39, 1.0);
  const PairOverGround foot = pair_over_ground(492.8, 0.12, {640, 480}, 31.55, 0.3);
  const PairOverGround small = pair_over_ground(257.69, 0.07, {512, 285}, 10, 0.2);
  EXPECT_EQ(map_scale(std::array{car}).side_m, 60);
  EXPECT_EQ(map_scale(std::array{car}).cell_m, 0.2);
  EXPECT_EQ(map_scale(std::array{foot, mast}).side_m, 8) << "the pair that sees farthest";
  EXPECT_EQ(map_scale(std::array{mast, foot}).cell_m, 0.05) << "the cell of the defaults, bit for bit";
  EXPECT_EQ(map_scale(std::array{foot}).side_m, 6);
  EXPECT_EQ(map_scale(std::array{small}).side_m, 2.4);
  EXPECT_EQ(map_scale(std::array{small}).cell_m, 0.015);
}

TEST(MapScale, WithoutAHeightFollowsTheRangeAlone) {
  const MapScale scale = map_scale(std::array{pair_over_ground(458, 0.11, {752, 480}, 0, std::nullopt)});
  EXPECT_EQ(scale.side_m, 8);
  EXPECT_EQ(scale.cell_m, 0.05);
  EXPECT_FALSE(scale.camera_height_m);
}

TEST(MapScale, OfThePaperLeavesTheDefaults) {
  RunOptions expected;
  expected.mapping.merging.max_range_m = 6;
  const RunOptions used = with_map_scale({}, {8, 0.05, 1.0, false}, {});
  EXPECT_EQ(option_differences(RunOptions(), used), "");
}

TEST(MapScale, ScalesLengthsThatWereNotGiven) {
  GivenKeys given;
  given.add("mapping.map.obstacle_m");
  RunOptions options;
  options.slam.match.block_m = 0.7;  // set in code
  const RunOptions used = with_map_scale(options, {60, 0.2, 1.68, true}, given);
  EXPECT_EQ(used.mapping.map.extent_m, 60);
  EXPECT_EQ(used.mapping.map.cell_m, 0.2);
  EXPECT_EQ(used.mapping.map.obstacle_m, RunOptions().mapping.map.obstacle_m) << "given";
  EXPECT_EQ(used.mapping.map.cavity_m, 0.4);
  EXPECT_EQ(used.mapping.merging.max_range_m, 45);
  EXPECT_NEAR(used.mapping.map.ground.window_m, 4 * RunOptions().mapping.map.ground.window_m, 1e-12);
  EXPECT_NEAR(used.slam.match.step_m, 0.2, 1e-12);
  EXPECT_EQ(used.slam.match.block_m, 0.7) << "set in code";
  EXPECT_TRUE(validate(used, "options"));
  EXPECT_THAT(to_text({60, 0.2, 1.68, true}, used), HasSubstr("side 60 m, cells of 0.2 m, obstacles from 0.1 m"));
}

}  // namespace
}  // namespace spartan::internal
