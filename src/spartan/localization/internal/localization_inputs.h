// What a Localizer was given, as bytes.
#pragma once

#include <optional>
#include <vector>

#include "spartan/core/archive.h"
#include "spartan/core/result.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {

struct LocalizationInputs {
  std::optional<LocalizationStart> start;
  std::vector<Measurement> measurements;  ///< accepted ones; those of the IMU have stamps by the clock of the cameras

  bool empty() const { return !start && measurements.empty(); }
  void add(const Measurement& measurement) { measurements.push_back(measurement); }
  Bytes bytes() const;
};

/// Codes `configuration` for another version, `store_damaged`.
Result<LocalizationInputs> parse_localization_inputs(const Bytes& bytes);

}  // namespace spartan::internal
