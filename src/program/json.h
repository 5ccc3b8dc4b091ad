// Values that go into the program's JSON.
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

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

/// The text of an object, indented by two blanks. Paths need not be UTF-8: other bytes are replaced by U+FFFD.
inline std::string text_of(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace spartan::program
