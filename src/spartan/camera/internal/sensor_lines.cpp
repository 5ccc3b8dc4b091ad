#include "spartan/camera/internal/sensor_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "spartan/camera/internal/table.h"

namespace spartan::internal {

SensorLines::SensorLines(std::string name, const Eigen::Quaterniond& body_from_imu)
    : name_(std::move(name)),
      sensors_{{{"imu", 7, read_imu_row(body_from_imu)},
                {"wheels", 3, read_wheel_row},
                {"compass", 3, read_compass_row},
                {"inclinometer", 4, read_inclinometer_row}}} {}

void SensorLines::add(std::string_view bytes, const Arrival& arrival) {
  for (;;) {
    const std::size_t end = bytes.find('\n');
    received_.append(bytes.substr(0, end));
    if (received_.size() > kLongestLine) {
      is_too_long_ = true;
      received_.resize(kLongestLine);
    }
    if (end == std::string_view::npos) return;
    add_line(received_, arrival);
    received_.clear();
    is_too_long_ = false;
    bytes.remove_prefix(end + 1);
  }
}

std::optional<Sample> SensorLines::take() {
  if (samples_.empty()) return std::nullopt;
  Sample sample = std::move(samples_.front());
  samples_.pop_front();
  return sample;
}

void SensorLines::add_line(std::string_view line, const Arrival& arrival) {
  if (is_too_long_) return discard(line, "the line is too long");
  std::vector<std::string_view> fields = split(line, ',');
  if (fields.size() == 1 && fields.front().empty()) return;
  const auto sensor =
      std::find_if(sensors_.begin(), sensors_.end(), [&](const Sensor& s) { return s.name == fields.front(); });
  if (sensor == sensors_.end()) return discard(line, "it begins with none of imu, wheels, compass and inclinometer");
  fields.erase(fields.begin());
  if (fields.size() < sensor->fields)
    return discard(line, fmt::format("{} values, expected {}", fields.size(), sensor->fields));
  auto sample = sample_of(*sensor, std::move(fields), arrival);
  if (!sample) return discard(line, sample.error().what);
  if (sensor->last && stamp_of(*sample) <= *sensor->last) {
    ++discarded_.reversed;
    return;
  }
  sensor->last = stamp_of(*sample);
  samples_.push_back(std::move(*sample));
  if (samples_.size() <= kMostWaiting) return;
  samples_.pop_front();
  discard(line, fmt::format("{} samples wait, the oldest one is discarded", kMostWaiting));
}

Result<Sample> SensorLines::sample_of(const Sensor& sensor, std::vector<std::string_view> row,
                                      const Arrival& arrival) const {
  const std::string system = std::to_string(arrival.system.ns);
  if (row.front().empty()) row.front() = system;
  auto sample = sensor.read_row(row);
  if (!sample) return sample;
  const double off_s = seconds_between(arrival.system, stamp_of(*sample));
  if (off_s > kAhead_s || off_s < -kLate_s)
    return failure(ErrorCode::input, fmt::format("its stamp is {:.3g} s off the clock of this computer", off_s));
  const std::int64_t host_minus_system = arrival.host.ns - arrival.system.ns;
  std::visit(
      [&](auto& of) {
        if constexpr (requires { of.stamp.ns; }) of.stamp.ns += host_minus_system;
      },
      *sample);
  return sample;
}

void SensorLines::discard(std::string_view line, const std::string& why) {
  if (++discarded_.unreadable > 1) return;
  std::string shown(line.substr(0, 80));
  std::replace_if(
      shown.begin(), shown.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  discarded_.first_unreadable = fmt::format("{}: '{}': {}", name_, shown, why);
}

}  // namespace spartan::internal
