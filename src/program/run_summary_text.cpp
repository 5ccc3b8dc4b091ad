#include "program/run_summary_text.h"

#include <fmt/format.h>

#include <cstdint>
#include <nlohmann/json.hpp>

namespace spartan::program {

std::string run_summary_text(const std::string& summary_json, const std::string& folder) {
  const auto s = nlohmann::json::parse(summary_json);
  const auto& health = s["health"]["odometry"];
  const double seconds = s["wall_seconds"].get<double>();
  std::string text = fmt::format(
      "{} frames, path length {:.2f} m; processed in {:.1f} s ({:.1f} frames/s, {:.1f} s of CPU), peak memory "
      "{:.0f} MB\n",
      s["frames"].get<int>(), s["distance_m"].get<double>(), seconds,
      seconds > 0 ? s["frames"].get<double>() / seconds : 0.0, s["cpu_seconds"].get<double>(),
      s["peak_memory_bytes"].get<double>() / 1e6);
  text += fmt::format("odometry: {} tracking, {} degraded, {} stationary, {} lost\n", health["tracking"].get<int>(),
                      health["degraded"].get<int>(), health["standing"].get<int>(), health["lost"].get<int>());
  const auto& slip = s["health"]["wheel_slip"];
  for (const auto& alarm : slip.is_null() ? nlohmann::json::array() : slip["alarms"]) {
    text += fmt::format("wheels slip by up to {:.0f} % from {} ns to {} ns\n", 100 * alarm["largest"].get<double>(),
                        alarm["from_ns"].get<std::int64_t>(), alarm["to_ns"].get<std::int64_t>());
  }
  std::string absent;
  for (const auto& part : s["absent"]) absent += (absent.empty() ? "" : ", ") + part.get<std::string>();
  if (!absent.empty()) text += "disabled: " + absent + "\n";
  for (const auto& [reason, count] : s["skipped"].items())
    text += fmt::format("skipped: {} {}\n", count.get<int>(), reason);
  for (const auto& span : s["lost_spans"]) {
    text += fmt::format("odometry lost from {} ns to {} ns: {}\n", span["from_ns"].get<std::int64_t>(),
                        span["to_ns"].get<std::int64_t>(), span["reason"].get<std::string>());
  }
  if (!s["lost_spans"].empty()) text += "there the poses are predictions, and the exit code is 6\n";
  return text + "results in " + folder + "\n";
}

}  // namespace spartan::program
