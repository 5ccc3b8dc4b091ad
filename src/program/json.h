// Values that go into the program's JSON.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

namespace spartan::program {

/// Keys stay in the order in which they are added.
using Json = nlohmann::ordered_json;

/// JSON has no NaN: a value that is missing or not finite becomes null. Negative zero becomes zero.
inline Json number(double value) {
  return std::isfinite(value) ? Json(value + 0.0) : Json(nullptr);
}
inline Json number(const std::optional<double>& value) {
  return value ? number(*value) : Json(nullptr);
}

}  // namespace spartan::program
