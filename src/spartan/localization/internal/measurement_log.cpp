#include "spartan/localization/internal/measurement_log.h"

#include <algorithm>

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
  const auto of = [&]<std::size_t kind>(std::integral_constant<std::size_t, kind>) -> Measurement {
    return std::get<kind>(samples_)[e.place];
  };
  switch (e.kind) {
    case 0:
      return of(std::integral_constant<std::size_t, 0>{});
    case 1:
      return of(std::integral_constant<std::size_t, 1>{});
    case 2:
      return of(std::integral_constant<std::size_t, 2>{});
    case 3:
      return of(std::integral_constant<std::size_t, 3>{});
    case 4:
      return of(std::integral_constant<std::size_t, 4>{});
    case 5:
      return of(std::integral_constant<std::size_t, 5>{});
    default:
      return of(std::integral_constant<std::size_t, 6>{});
  }
}

}  // namespace spartan::internal
