#include "spartan/localization/internal/measurement_log.h"

#include <algorithm>
#include <utility>

namespace spartan::internal {

void MeasurementLog::add(const Measurement& measurement, const ProcessingOrder& order) {
  std::visit(
      [&](const auto& value) {
        auto& of_kind = all<std::decay_t<decltype(value)>>();
        entries_.push_back({order.turn_of(measurement), static_cast<std::uint32_t>(measurement.index()),
                            static_cast<std::uint32_t>(of_kind.size())});
        of_kind.push_back(value);
      },
      measurement);
}

void MeasurementLog::sort() {
  const auto key = [](const Entry& e) { return std::tuple(e.turn, e.kind); };
  std::stable_sort(entries_.begin(), entries_.end(), [&](const Entry& a, const Entry& b) { return key(a) < key(b); });
  const auto equal = [&](const Entry& a, const Entry& b) { return key(a) == key(b); };
  entries_.erase(std::unique(entries_.begin(), entries_.end(), equal), entries_.end());
}

Measurement MeasurementLog::operator[](std::size_t index) const {
  const Entry& e = entries_[index];
  Measurement measurement;
  const auto take = [&]<std::size_t... kind>(std::index_sequence<kind...>) {
    ((e.kind == kind ? static_cast<void>(measurement = std::get<kind>(samples_)[e.place]) : void()), ...);
  };
  take(std::make_index_sequence<std::variant_size_v<Measurement>>{});
  return measurement;
}

}  // namespace spartan::internal
