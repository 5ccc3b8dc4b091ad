#include "spartan/rig/internal/camera_driver.h"

#include <fmt/format.h>

#include <array>
#include <utility>

namespace spartan::internal {
namespace {

constexpr std::array<std::pair<const char*, StampAt>, 3> kMoments{{{"exposure_start", StampAt::exposure_start},
                                                                   {"exposure_middle", StampAt::exposure_middle},
                                                                   {"exposure_end", StampAt::exposure_end}}};

double number_between(YamlMap& map, const char* key, double low, double high) {
  if (!map.has(key)) return 0;
  const double value = map.number(key).value_or(low);
  if (!(value >= low && value <= high))
    map.add_error(key, fmt::format("is {}, must be between {} and {}", value, low, high));
  return value;
}

}  // namespace

CameraDriver read_camera_driver(YamlMap map) {
  CameraDriver driver;
  driver.source = map.text("source").value_or("");
  if (map.has("trigger")) driver.trigger = map.text("trigger").value_or(driver.trigger);
  driver.rate_hz = number_between(map, "rate_hz", 0, 1000);
  driver.black_level = number_between(map, "black_level", 0, 65535);
  driver.latency_ms = number_between(map, "latency_ms", 0, 1000);
  if (map.has("stamp_at")) {
    const auto moment = map.choice("stamp_at", {kMoments[0].first, kMoments[1].first, kMoments[2].first});
    for (const auto& [name, value] : kMoments) {
      if (moment == name) driver.stamp_at = value;
    }
  }
  map.reject_unknown_keys();
  return driver;
}

std::string camera_driver_lines(const CameraDriver& driver) {
  const char* moment = kMoments[0].first;
  for (const auto& [name, value] : kMoments) {
    if (driver.stamp_at == value) moment = name;
  }
  return fmt::format(
      "    driver:\n      source: {}\n      trigger: {}\n      rate_hz: {}\n      black_level: {}\n      stamp_at: {}\n"
      "      latency_ms: {}\n",
      yaml_quoted(driver.source), yaml_quoted(driver.trigger), driver.rate_hz, driver.black_level, moment,
      driver.latency_ms);
}

}  // namespace spartan::internal
