#include "spartan/reconstruction/internal/left_border.h"

#include <gtest/gtest.h>

#include <cmath>

namespace spartan::internal {
namespace {

// A camera that looks down by 30° from a height of 1 m. The ground in the middle of row v is at the depth
// 1 / (sin 30° + y cos 30°), y = (v − 50) / 100, and its disparity 100 · 0.2 over that.
TEST(LeftBorder, DropsWhatIsBelowTheGroundWhereTheGroundHasNoPartner) {
  const RectifiedStereo geometry{{120, 101}, 100, {60, 50}, 0.2};
  const GroundPlane plane{Eigen::Vector3d(0, -std::cos(0.5235987756), -0.5), 1};
  const double ground_px = 20 * 0.5;
  Image<float> disparity(120, 101, static_cast<float>(ground_px));
  for (const int u : {0, 3, 9}) disparity(u, 50) = 4;  // −1.5 m
  disparity(5, 50) = 8.5F;                             // −0.18 m: a depression
  disparity(11, 50) = 4;                               // ground has a partner here
  disparity(7, 50) = std::nanf("");
  drop_matches_below_ground(plane, geometry, disparity);
  for (const int u : {0, 3, 9, 7}) EXPECT_TRUE(std::isnan(disparity(u, 50))) << u;
  EXPECT_EQ(disparity(5, 50), 8.5F);
  EXPECT_EQ(disparity(11, 50), 4);
  EXPECT_EQ(disparity(1, 50), static_cast<float>(ground_px)) << "ground is kept, though its partner is outside";
}

}  // namespace
}  // namespace spartan::internal
