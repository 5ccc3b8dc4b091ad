#include "spartan/sim/faults.h"

#include <gtest/gtest.h>

#include <cmath>

namespace spartan::sim {
namespace {

TEST(CameraFaults, LastFromTheirStartUpToTheirEnd) {
  const CameraFaults faults{{"dropped", "", 1, 2, 0}};
  EXPECT_FALSE(fault_of(faults, "narrow", 0.999, 0, 1).dropped);
  EXPECT_TRUE(fault_of(faults, "narrow", 1, 0, 1).dropped);
  EXPECT_TRUE(fault_of(faults, "wide", 1.999, 0, 1).dropped);
  EXPECT_FALSE(fault_of(faults, "narrow", 2, 0, 1).dropped);
}

TEST(CameraFaults, OfOnePairTouchNoOther) {
  const CameraFaults faults{{"left_dark", "narrow", 0, 9, 0}};
  EXPECT_EQ(fault_of(faults, "wide", 1, 0, 1).left.light, 1);
  const ShotFault dark = fault_of(faults, "narrow", 1, 0, 1);
  EXPECT_LT(dark.left.light, 0.01);
  EXPECT_EQ(dark.right.light, 1);
}

TEST(CameraFaults, EachDoesWhatItsNameSays) {
  const auto alone = [](const char* kind, double amount = 0) {
    return fault_of({{kind, "", 0, 9, amount}}, "narrow", 1, 4, 1);
  };
  EXPECT_LT(alone("right_dark").right.light, 0.01);
  EXPECT_EQ(alone("right_dark").left.light, 1);
  EXPECT_TRUE(alone("left_dust").left.dust);
  EXPECT_FALSE(alone("left_dust").right.dust);
  EXPECT_TRUE(alone("right_dust").right.dust);
  for (const char* kind : {"overexposed", "brightness_step"}) {
    EXPECT_EQ(alone(kind, 3).left.light, 3) << kind;
    EXPECT_EQ(alone(kind, 3).right.light, 3) << kind;
  }
  EXPECT_FALSE(alone("stamp_jitter", 0.01).dropped);
}

TEST(CameraFaults, SeveralAddUp) {
  const ShotFault both = fault_of(
      {{"brightness_step", "", 0, 9, 3}, {"overexposed", "", 0, 9, 2}, {"left_dust", "", 5, 9, 0}}, "narrow", 1, 0, 1);
  EXPECT_EQ(both.left.light, 6);
  EXPECT_FALSE(both.left.dust) << "not yet";
}

// Each shot and eye has a jitter of its own, the same whenever it is asked for; dust stays where it is.
TEST(CameraFaults, JitterIsNormalAndDustLasts) {
  const CameraFaults faults{{"stamp_jitter", "", 0, 9, 0.002}, {"left_dust", "", 0, 9, 0}};
  constexpr int kShots = 4000;
  double sum = 0, squares = 0, product = 0;
  for (std::uint64_t shot = 0; shot < kShots; ++shot) {
    const ShotFault fault = fault_of(faults, "narrow", 1, shot, 1), again = fault_of(faults, "narrow", 2, shot, 1);
    EXPECT_EQ(fault.left_jitter_s, again.left_jitter_s);
    EXPECT_EQ(fault.left.dust_seed, fault_of(faults, "narrow", 1, 0, 1).left.dust_seed);
    sum += fault.left_jitter_s;
    squares += fault.left_jitter_s * fault.left_jitter_s;
    product += fault.left_jitter_s * fault.right_jitter_s;
  }
  EXPECT_NEAR(sum / kShots, 0, 0.0001);
  EXPECT_NEAR(std::sqrt(squares / kShots), 0.002, 0.0001);
  EXPECT_NEAR(product / squares, 0, 0.05) << "the eyes' are independent";
  EXPECT_NE(fault_of(faults, "narrow", 1, 0, 1).left_jitter_s, fault_of(faults, "narrow", 1, 0, 2).left_jitter_s);
}

}  // namespace
}  // namespace spartan::sim
