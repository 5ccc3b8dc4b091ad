// Initialization of an IMU that is not in use: the vertical, biases and velocity.
#pragma once

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

class InertialInitialization {
 public:
  explicit InertialInitialization(const LocalizationOptions& options)
      : options_(options.imu), gravity_m_s2_(options.gravity_m_s2) {}

  /// The next sample after `memory.imu.last`. Once the visual motions of the last frames and the IMU agree on its
  /// biases and on the vertical (inertial_alignment.h), these are taken over, and the IMU is aligned; one that cannot
  /// be aligned is suspect after a while. A vertical that nothing else has given is levelled at once.
  void add(FilterMemory& memory, const ImuSample& sample) const;

 private:
  void search_alignment(FilterMemory& memory, const ImuSample& sample) const;
  AlignmentPrior prior(const FilterMemory& memory) const;
  void level(FilterMemory& memory, const ImuSample& sample) const;

  InertialOptions options_;
  double gravity_m_s2_;
};

/// Takes over biases, velocity and clock, of which nothing is known. The direction of gravity in the body frame
/// corrects attitude and tilt, with the noise that it shares with the errors of the biases and the velocity.
void take_over(FilterMemory& memory, const InertialAlignment& alignment);

}  // namespace spartan::internal
