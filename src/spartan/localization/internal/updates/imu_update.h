// Samples of the IMU: its clock, checks of its readings, and the propagation by them.
#pragma once

#include "spartan/localization/internal/filter_memory.h"
#include "spartan/localization/internal/updates/inertial_initialization.h"
#include "spartan/localization/internal/updates/state_propagation.h"
#include "spartan/localization/internal/updates/zero_velocity_update.h"
#include "spartan/localization/localization_options.h"

namespace spartan::internal {

/// Whether a reading is in the physical range of a rover.
bool is_possible(const ImuSample& sample);

class ImuUpdate {
 public:
  explicit ImuUpdate(const LocalizationOptions& options);

  /// A sample with the stamp by the clock of the IMU, which waits until it is needed.
  void add(FilterMemory& memory, const ImuSample& by_own_clock) const;

  /// Propagates to a time by the clock of the cameras, with the readings up to it. If the next one is known already,
  /// the last step is interpolated.
  void advance_to(FilterMemory& memory, Stamp stamp) const;

 private:
  void use_waiting_until(FilterMemory& memory, Stamp stamp) const;
  ImuSample at_frame_time(const FilterMemory& memory, const ImuSample& by_own_clock) const;
  void use(FilterMemory& memory, const ImuSample& sample) const;
  void check_reading(FilterMemory& memory, const ImuSample& sample) const;

  InertialOptions options_;
  int readmit_after_;
  StatePropagation propagation_;
  InertialInitialization initialization_;
  ZeroVelocityUpdate zero_velocity_;
};

}  // namespace spartan::internal
