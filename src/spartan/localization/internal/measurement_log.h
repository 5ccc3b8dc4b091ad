// The measurements of a drive, sorted and in little memory.
#pragma once

#include <cstdint>
#include <tuple>
#include <vector>

#include "spartan/localization/internal/processing_order.h"

namespace spartan::internal {

/// Measurements by kind: a variant would take the memory of the largest for each.
class MeasurementLog {
 public:
  void add(const Measurement& measurement, const ProcessingOrder& order);
  /// Afterwards the measurements are in the order of processing; of those with equal stamps and kinds the first stays.
  void sort();

  std::size_t size() const { return entries_.size(); }
  Measurement operator[](std::size_t index) const;
  Stamp turn(std::size_t index) const { return entries_[index].turn; }

 private:
  struct Entry {
    Stamp turn;
    std::uint32_t kind = 0, place = 0;
  };
  template <class T>
  std::vector<T>& all() {
    return std::get<std::vector<T>>(samples_);
  }

  std::vector<Entry> entries_;
  std::tuple<std::vector<ImuSample>, std::vector<RelativeMotion>, std::vector<WheelSample>, std::vector<CompassSample>,
             std::vector<InclinometerSample>, std::vector<PoseConstraint>, std::vector<LateConstraint>>
      samples_;
};

}  // namespace spartan::internal
