// Values that go into the program's JSON.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

namespace spartan::program {

/// Keys stay in the order in which they are added.
using Json = nlohmann::ordered_json;

/// JSON has no NaN: what is not finite, or not there, becomes null. Nor is there a negative zero to wonder about.
inline Json number(double value) {
  return std::isfinite(value) ? Json(value + 0.0) : Json(nullptr);
}
inline Json number(const std::optional<double>& value) {
  return value ? number(*value) : Json(nullptr);
}

}  // namespace spartan::program
