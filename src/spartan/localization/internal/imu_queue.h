// IMU samples that wait until the filter reaches their time.
#pragma once

#include <array>
#include <cstdint>

#include "spartan/camera/samples.h"

namespace spartan::internal {

/// In order of time. The clock of the IMU may be off, so that the reading at the time of a frame has a later stamp.
class ImuQueue {
 public:
  /// 0.2 s at 500 Hz.
  static constexpr std::uint32_t kCapacity = 100;

  bool empty() const { return count_ == 0; }
  bool full() const { return count_ == kCapacity; }
  std::uint32_t size() const { return count_; }
  /// The oldest sample; the queue must not be empty.
  const ImuSample& front() const { return samples_[first_]; }
  /// From the oldest on.
  const ImuSample& operator[](std::uint32_t i) const { return samples_[(first_ + i) % kCapacity]; }
  /// The queue must not be full.
  void push(const ImuSample& sample) { samples_[(first_ + count_++) % kCapacity] = sample; }
  void pop() {
    first_ = (first_ + 1) % kCapacity;
    --count_;
  }

 private:
  std::array<ImuSample, kCapacity> samples_;
  std::uint32_t first_ = 0, count_ = 0;
};

}  // namespace spartan::internal
