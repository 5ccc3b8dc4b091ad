#include "spartan/sim/internal/camera/faults.h"

#include "spartan/numerics/random.h"

namespace spartan::sim::internal {
namespace {

constexpr double kDarkness = 0.002;  // fraction of the light that reaches a covered camera

void apply(const CameraFault& fault, Random& random, std::uint64_t seed, FrameFaultState& state) {
  using enum CameraFaultKind;
  switch (fault.kind) {
    case dropped:
      state.dropped = true;
      break;
    case left_dark:
      state.left.light_factor *= kDarkness;
      break;
    case right_dark:
      state.right.light_factor *= kDarkness;
      break;
    case left_dust:
      state.left.dust = true;
      break;
    case right_dust:
      state.right.dust = true;
      break;
    case overexposed:
    case brightness_step:
      state.left.light_factor *= fault.amount;
      state.right.light_factor *= fault.amount;
      break;
    case stamp_jitter:
      state.left_jitter_s = random.normal(0, fault.amount);
      state.right_jitter_s = random.normal(0, fault.amount);
      break;
  }
  state.left.dust_seed = seed + 1;
  state.right.dust_seed = seed + 2;
}

}  // namespace

FrameFaultState fault_state(const CameraFaults& faults, const std::string& pair, double time_s,
                            std::uint64_t frame_index, std::uint64_t seed) {
  FrameFaultState result;
  Random random(seed + frame_index, 301);
  for (const CameraFault& fault : faults) {
    if ((fault.pair.empty() || fault.pair == pair) && time_s >= fault.from_s && time_s < fault.to_s)
      apply(fault, random, seed, result);
  }
  return result;
}

}  // namespace spartan::sim::internal
