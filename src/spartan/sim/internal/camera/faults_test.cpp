#include "spartan/sim/internal/camera/faults.h"

#include <gtest/gtest.h>

#include <cmath>

namespace spartan::sim::internal {
namespace {

TEST(CameraFaults, AreActiveFromTheirStartUpToTheirEnd) {
  const CameraFaults faults{{CameraFaultKind::dropped, "", 1, 2, 0}};
  EXPECT_FALSE(fault_state(faults, "narrow", 0.999, 0, 1).dropped);
  EXPECT_TRUE(fault_state(faults, "narrow", 1, 0, 1).dropped);
  EXPECT_TRUE(fault_state(faults, "wide", 1.999, 0, 1).dropped);
  EXPECT_FALSE(fault_state(faults, "narrow", 2, 0, 1).dropped);
}

TEST(CameraFaults, OfOnePairDoNotAffectOthers) {
  const CameraFaults faults{{CameraFaultKind::left_dark, "narrow", 0, 9, 0}};
  EXPECT_EQ(fault_state(faults, "wide", 1, 0, 1).left.light_factor, 1);
  const FrameFaultState dark = fault_state(faults, "narrow", 1, 0, 1);
  EXPECT_LT(dark.left.light_factor, 0.01);
  EXPECT_EQ(dark.right.light_factor, 1);
}

TEST(CameraFaults, EveryKindHasItsEffect) {
  const auto alone = [](CameraFaultKind kind, double amount = 0) {
    return fault_state({{kind, "", 0, 9, amount}}, "narrow", 1, 4, 1);
  };
  EXPECT_LT(alone(CameraFaultKind::right_dark).right.light_factor, 0.01);
  EXPECT_EQ(alone(CameraFaultKind::right_dark).left.light_factor, 1);
  EXPECT_TRUE(alone(CameraFaultKind::left_dust).left.dust);
  EXPECT_FALSE(alone(CameraFaultKind::left_dust).right.dust);
  EXPECT_TRUE(alone(CameraFaultKind::right_dust).right.dust);
  for (const auto kind : {CameraFaultKind::overexposed, CameraFaultKind::brightness_step}) {
    EXPECT_EQ(alone(kind, 3).left.light_factor, 3) << name_of(kind);
    EXPECT_EQ(alone(kind, 3).right.light_factor, 3) << name_of(kind);
  }
  EXPECT_FALSE(alone(CameraFaultKind::stamp_jitter, 0.01).dropped);
}

TEST(CameraFaults, Combine) {
  const FrameFaultState both = fault_state({{CameraFaultKind::brightness_step, "", 0, 9, 3},
                                            {CameraFaultKind::overexposed, "", 0, 9, 2},
                                            {CameraFaultKind::left_dust, "", 5, 9, 0}},
                                           "narrow", 1, 0, 1);
  EXPECT_EQ(both.left.light_factor, 6);
  EXPECT_FALSE(both.left.dust) << "it starts later";
}

// Each frame and camera has its own jitter, which does not depend on the order of the calls; the dust does not move.
TEST(CameraFaults, JitterIsNormalAndDustIsConstant) {
  const CameraFaults faults{{CameraFaultKind::stamp_jitter, "", 0, 9, 0.002},
                            {CameraFaultKind::left_dust, "", 0, 9, 0}};
  constexpr int kFrames = 4000;
  double sum = 0, squares = 0, product = 0;
  for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
    const FrameFaultState fault = fault_state(faults, "narrow", 1, frame, 1),
                          again = fault_state(faults, "narrow", 2, frame, 1);
    EXPECT_EQ(fault.left_jitter_s, again.left_jitter_s);
    EXPECT_EQ(fault.left.dust_seed, fault_state(faults, "narrow", 1, 0, 1).left.dust_seed);
    sum += fault.left_jitter_s;
    squares += fault.left_jitter_s * fault.left_jitter_s;
    product += fault.left_jitter_s * fault.right_jitter_s;
  }
  EXPECT_NEAR(sum / kFrames, 0, 0.0001);
  EXPECT_NEAR(std::sqrt(squares / kFrames), 0.002, 0.0001);
  EXPECT_NEAR(product / squares, 0, 0.05) << "jitter of left and right cameras is independent";
  EXPECT_NE(fault_state(faults, "narrow", 1, 0, 1).left_jitter_s, fault_state(faults, "narrow", 1, 0, 2).left_jitter_s);
}

}  // namespace
}  // namespace spartan::sim::internal
