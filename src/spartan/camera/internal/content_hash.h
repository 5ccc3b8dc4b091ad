// Hash of the content of a recording, to detect that it was changed between a run and its continuation.
#pragma once

#include <bit>
#include <cstdint>
#include <initializer_list>
#include <string_view>

#include "spartan/camera/samples.h"
#include "spartan/core/archive.h"

namespace spartan::internal {

/// Hash of files and sensor samples in the order in which they were taken.
class ContentHash {
 public:
  std::uint64_t value() const { return hash_.value(); }

  void add(std::string_view bytes) { hash_.add(bytes.data(), bytes.size()); }
  /// A sensor sample: its kind, stamp and values.
  void add(const Sample& sample) {
    hash_.add(sample.index());
    hash_.add(static_cast<std::uint64_t>(stamp_of(sample).ns));
    if (const auto* imu = std::get_if<ImuSample>(&sample)) {
      add_numbers({imu->gyro_rad_s.x(), imu->gyro_rad_s.y(), imu->gyro_rad_s.z()});
      add_numbers({imu->accel_m_s2.x(), imu->accel_m_s2.y(), imu->accel_m_s2.z()});
    }
    if (const auto* wheels = std::get_if<WheelSample>(&sample)) add_numbers({wheels->left_m, wheels->right_m});
    if (const auto* compass = std::get_if<CompassSample>(&sample))
      add_numbers({compass->heading_rad, compass->sigma_rad});
    if (const auto* level = std::get_if<InclinometerSample>(&sample))
      add_numbers({level->roll_rad, level->pitch_rad, level->sigma_rad});
  }

 private:
  void add_numbers(std::initializer_list<double> values) {
    for (const double value : values) hash_.add(std::bit_cast<std::uint64_t>(value));
  }

  Hash64 hash_;
};

}  // namespace spartan::internal
