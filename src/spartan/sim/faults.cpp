#include "spartan/sim/faults.h"

#include "spartan/core/random.h"

namespace spartan::sim {
namespace {

constexpr double kDarkness = 0.002;  // light that a covered eye still gets

void apply(const CameraFault& fault, Random& random, std::uint64_t seed, ShotFault& shot) {
  if (fault.kind == "dropped") shot.dropped = true;
  if (fault.kind == "left_dark") shot.left.light *= kDarkness;
  if (fault.kind == "right_dark") shot.right.light *= kDarkness;
  if (fault.kind == "left_dust") shot.left.dust = true;
  if (fault.kind == "right_dust") shot.right.dust = true;
  if (fault.kind == "overexposed" || fault.kind == "brightness_step") {
    shot.left.light *= fault.amount;
    shot.right.light *= fault.amount;
  }
  if (fault.kind == "stamp_jitter") {
    shot.left_jitter_s = random.normal(0, fault.amount);
    shot.right_jitter_s = random.normal(0, fault.amount);
  }
  shot.left.dust_seed = seed + 1;
  shot.right.dust_seed = seed + 2;
}

}  // namespace

ShotFault fault_of(const CameraFaults& faults, const std::string& pair, double time_s, std::uint64_t shot,
                   std::uint64_t seed) {
  ShotFault result;
  Random random(seed + shot, 301);
  for (const CameraFault& fault : faults) {
    if ((fault.pair.empty() || fault.pair == pair) && time_s >= fault.from_s && time_s < fault.to_s)
      apply(fault, random, seed, result);
  }
  return result;
}

}  // namespace spartan::sim
