#include "spartan/reconstruction/internal/cell_support.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace spartan::internal {
namespace {

constexpr float kUnseen = std::numeric_limits<float>::quiet_NaN();

int count(const Image<std::uint8_t>& cells) {
  int sum = 0;
  for (int y = 0; y < cells.height(); ++y) {
    for (int x = 0; x < cells.width(); ++x) sum += cells(x, y) != 0 ? 1 : 0;
  }
  return sum;
}

TEST(CellSupport, GroupsThatStandApartAreIsolated) {
  Image<float> low(20, 20, 0.0F), high(20, 20, 0.02F);
  const auto isolated = [&] { return isolated_cells({low, high}, 0.15, 4); };
  EXPECT_EQ(count(isolated()), 0);
  // Three cells a metre above the ground.
  for (const int x : {5, 6, 7}) low(x, 5) = high(x, 5) = 1;
  EXPECT_EQ(count(isolated()), 3);
  // Four of them are an object.
  low(5, 6) = high(5, 6) = 1;
  EXPECT_EQ(count(isolated()), 0);
  // A post of one cell reaches down to the ground.
  low(12, 12) = 0.1F;
  high(12, 12) = 1.5F;
  EXPECT_EQ(count(isolated()), 0);
  low(15, 3) = high(15, 3) = kUnseen;
  EXPECT_EQ(count(isolated()), 1) << "unknown cells";
}

class GroundViews : public ::testing::Test {
 protected:
  // Cells of level ground, seen from 1 m above the left edge.
  GroundViews() {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) towards_(x, y) = {-1, 0, 1 / (0.05F * static_cast<float>(x + 1))};
    }
  }
  Image<std::uint8_t> hidden() const {
    return cells_seen_through_ground({heights_, heights_}, {ground_, towards_, 0.05, 0.15, 0.6});
  }
  static constexpr int kSide = 80;
  Image<float> heights_{kSide, kSide, 0.0F}, ground_{kSide, kSide, 0.0F};
  Image<LineOfSight> towards_{kSide, kSide};
};

TEST_F(GroundViews, ACellCannotBeSeenThroughTheGround) {
  EXPECT_EQ(count(hidden()), 0);
  heights_(70, 40) = heights_(71, 40) = -2;
  EXPECT_EQ(count(hidden()), 2);
  // Nor where the ground between is unknown but for its fitted surface.
  for (int x = 0; x < 70; ++x) heights_(x, 40) = kUnseen;
  EXPECT_EQ(count(hidden()), 2);
}

// Where all cells of a place are wrong the surface is fitted to them.
TEST_F(GroundViews, NorWhereTheSurfaceFollowsIt) {
  for (int x = 66; x < kSide; ++x) {
    heights_(x, 40) = ground_(x, 40) = -1.5F;
    towards_(x, 40).rise = 2.5F / (0.05F * static_cast<float>(x + 1));
  }
  EXPECT_EQ(count(hidden()), kSide - 66);
}

// A wall behind the camera hides nothing in front of it.
TEST_F(GroundViews, TheLineOfSightEndsAtTheCamera) {
  for (int x = 0; x < kSide; ++x) towards_(x, 40) = {-1, 0, 0.25F};
  for (int x = 0; x < 30; ++x) ground_(x, 40) = 3;
  EXPECT_GT(count(hidden()), 0);
  for (int x = 30; x < kSide; ++x) towards_(x, 40).length_m = 0.05F * static_cast<float>(x - 30);
  for (int x = 0; x < 30; ++x) heights_(x, 40) = kUnseen;
  EXPECT_EQ(count(hidden()), 0);
}

TEST_F(GroundViews, ACellIsSeenFromStraightAbove) {
  towards_ = Image<LineOfSight>(kSide, kSide, LineOfSight{0, 0, 1e6F});
  heights_(30, 30) = -1;
  EXPECT_EQ(count(hidden()), 0);
}

TEST_F(GroundViews, PitsAreSeenThroughTheirOpening) {
  // 0.5 m wide and 0.3 m deep, its far wall seen from the camera.
  for (int x = 40; x < 50; ++x) heights_(x, 40) = -0.3F;
  EXPECT_EQ(count(hidden()), 0);
  // The same depth without end: a plain below a step.
  for (int x = 40; x < kSide; ++x) heights_(x, 40) = ground_(x, 40) = -0.3F;
  EXPECT_EQ(count(hidden()), 0);
}

}  // namespace
}  // namespace spartan::internal
