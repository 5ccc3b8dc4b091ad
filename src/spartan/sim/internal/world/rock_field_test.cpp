#include "spartan/sim/internal/world/rock_field.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace spartan::sim::internal {
namespace {

TEST(Golombek, CoverMatchesTheModel) {
  // Golombek & Rapp 1997: k = 0.1 gives q = 3.31.
  EXPECT_NEAR(golombek_q(0.1), 3.31, 1e-12);
  EXPECT_NEAR(golombek_cover(0.1, 0), 0.1, 1e-12);
  EXPECT_NEAR(golombek_cover(0.1, 0.5), 0.1 * std::exp(-1.655), 1e-12);
  EXPECT_EQ(golombek_count_per_m2(0, 0.1, 1), 0);
}

TEST(Golombek, CountsAddUpToTheCover) {
  for (const double k : {0.05, 0.1, 0.2}) {
    double cover = 0;
    for (double d = 0.05; d < 6; d *= 1.01) {
      const double middle = d * std::sqrt(1.01);
      cover += golombek_count_per_m2(k, d, d * 1.01) * std::numbers::pi / 4 * middle * middle;
    }
    EXPECT_NEAR(cover, golombek_cover(k, 0.05), 1e-3 * cover) << k;
  }
}

// The fraction of the ground covered by rocks of a diameter and more, measured over a hectare.
TEST(RockField, CumulativeAreaFollowsTheModel) {
  constexpr double kSide = 100;
  for (const double k : {0.05, 0.1, 0.2}) {
    const RockField field({.coverage = k, .smallest_m = 0.03, .largest_m = 3, .height_ratio = 0.5}, 5);
    const auto rocks = field.rocks_in({0, 0, kSide, kSide});
    for (const double diameter : {0.05, 0.1, 0.2, 0.3, 0.5}) {
      double area = 0;
      for (const Rock& rock : rocks) {
        if (rock.diameter_m >= diameter) area += std::numbers::pi / 4 * rock.diameter_m * rock.diameter_m;
      }
      const double wanted = golombek_cover(k, diameter) - golombek_cover(k, 3);
      fmt::print("k {}, {} m and more: {:+.2f} %\n", k, diameter, 100 * (area / (kSide * kSide) / wanted - 1));
      EXPECT_NEAR(area / (kSide * kSide), wanted, 0.1 * wanted) << "k " << k << ", D " << diameter;
    }
  }
}

TEST(RockField, QueriesOfTheSamePlaceReturnTheSameRocks) {
  const RockField field({}, 9);
  const auto whole = field.rocks_in({-4, -4, 4, 4}), again = field.rocks_in({-4, -4, 4, 4});
  ASSERT_EQ(whole.size(), again.size());
  std::size_t parts = 0;
  for (const double x : {-4.0, 0.0}) {
    for (const double y : {-4.0, 0.0}) parts += field.rocks_in({x, y, x + 4, y + 4}).size();
  }
  EXPECT_EQ(parts, whole.size());
  EXPECT_NE(RockField({}, 10).rocks_in({-4, -4, 4, 4}).size(), whole.size());
  EXPECT_TRUE(RockField({.coverage = 0, .pebbles_per_m2 = 0}, 9).rocks_in({-50, -50, 50, 50}).empty());
}

TEST(RockField, FractionsOfBuriedAndLayeredRocksChangeNoOtherRock) {
  const RockFieldOptions plain{.coverage = 0.1, .pebbles_per_m2 = 0};
  RockFieldOptions mixed = plain;
  mixed.buried_fraction = 0.3;
  mixed.layered_fraction = 0.5;
  const Region region{-5, -5, 5, 5};
  const std::vector<Rock> before = RockField(plain, 3).rocks_in(region), rocks = RockField(mixed, 3).rocks_in(region);
  ASSERT_EQ(before.size(), rocks.size());
  double buried = 0, layered = 0;
  for (std::size_t i = 0; i < rocks.size(); ++i) {
    EXPECT_EQ(rocks[i].diameter_m, before[i].diameter_m);
    EXPECT_EQ(rocks[i].buried, rocks[i].height_m < before[i].height_m);
    buried += rocks[i].buried ? 1 : 0;
    layered += rocks[i].layers > 0 ? 1 : 0;
  }
  const auto count = static_cast<double>(rocks.size());
  EXPECT_NEAR(buried / count, 0.3, 0.03);
  EXPECT_NEAR(layered / count, 0.5, 0.03);
}

TEST(RockField, CorridorOfTheWheelsLeavesRocksBetweenThem) {
  std::vector<PlanarPose> track;
  for (int i = 0; i <= 2000; ++i) track.push_back({0.01 * i, 0, 0});
  RockField field({.coverage = 0.2, .pebbles_per_m2 = 0}, 6);
  for (const double left_m : {0.3, -0.3}) field.clear_corridor(DriveCorridor(track, 0.1, {0, left_m}), 0.05);
  field.clear_corridor(DriveCorridor(track, 0.3), 0.18);
  int between = 0, high = 0;
  for (const Rock& rock : field.rocks_in({0, -1, 20, 1})) {
    const double beside_wheel = std::abs(std::abs(rock.y) - 0.3) - 0.5 * rock.diameter_m;
    if (beside_wheel < 0.1) {
      EXPECT_LE(rock.height_m, 0.05) << rock.x << ' ' << rock.y;
    }
    if (std::abs(rock.y) < 0.3) {
      EXPECT_LE(rock.height_m, 0.18);
      between += rock.height_m > 0.05 ? 1 : 0;
    }
    high += rock.height_m > 0.18 ? 1 : 0;
  }
  EXPECT_GT(between, 5);
  EXPECT_GT(high, 0) << "beside the rover";
}

}  // namespace
}  // namespace spartan::sim::internal
