#include "spartan/camera/internal/flir_pan_tilt.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

namespace spartan::internal {
namespace {

constexpr double kSecondOfArc_rad = std::numbers::pi / 180 / 3600;
constexpr double kDegree = std::numbers::pi / 180;

// The number at the end of a text: terse answers end with it, and verbose ones about positions.
std::optional<double> last_number(std::string_view text) {
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.remove_suffix(1);
  const auto word = text.substr(text.find_last_of(" *") + 1);
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::string trimmed(const std::string& text) {
  const auto begin = text.find_first_not_of(' ');
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
}

// What follows the mark of an answer; empty where a line is none. The echo of a command may come before the mark.
struct Answer {
  bool refused = false;
  std::string text;
};
std::optional<Answer> answer_in(const std::string& line, const std::string& command) {
  const auto mark = line.find_first_of("*!");
  if (mark == std::string::npos) return std::nullopt;
  const std::string before = trimmed(line.substr(0, mark)), text = trimmed(line.substr(mark + 1));
  if (!before.empty() && !command.starts_with(before)) return std::nullopt;
  const bool refused = line[mark] == '!';
  if (refused && text.empty()) return std::nullopt;
  return Answer{refused, text};
}

template <class Number>
Result<Number> number_in(const std::string& text, const std::string& where) {
  Number value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && end == text.data() + text.size()) return value;
  constexpr bool is_whole = std::is_integral_v<Number>;
  return failure(ErrorCode::usage, "'" + text + "' is not a " + (is_whole ? "whole number" : "number"), where);
}

// Sets what `key` names.
Status set_part(FlirAddress& address, const std::string& key, const std::string& value, const std::string& text) {
  if (key == "pan_deg_s" || key == "tilt_deg_s") {
    const auto speed = number_in<double>(value, text);
    if (!speed) return failure(speed);
    if (!(*speed > 0) || !std::isfinite(*speed))
      return failure(ErrorCode::usage, "the speed " + key + " must be positive", text);
    (key == "pan_deg_s" ? address.pan_deg_s : address.tilt_deg_s) = *speed;
    return {};
  }
  const auto number = number_in<int>(value, text);
  if (!number) return failure(number);
  const bool is_sign = *number == 1 || *number == -1;
  if (key == "baud") {
    address.baud = *number;
  } else if (key == "pan" && is_sign) {
    address.pan_sign = *number;
  } else if (key == "tilt" && is_sign) {
    address.tilt_sign = *number;
  } else {
    return failure(ErrorCode::usage, fmt::format("'{}={}' is not possible", key, value), text,
                   "use baud=RATE, pan=1, pan=-1, tilt=1, tilt=-1, pan_deg_s=SPEED or tilt_deg_s=SPEED");
  }
  return {};
}

}  // namespace

Result<FlirAddress> parse_flir_address(const std::string& text) {
  FlirAddress address;
  const auto mark = text.find('?');
  address.device = text.substr(0, mark);
  if (address.device.empty()) return failure(ErrorCode::usage, "names no serial device", text);
  std::string rest = mark == std::string::npos ? "" : text.substr(mark + 1);
  while (!rest.empty()) {
    const auto end = std::min(rest.find('&'), rest.size());
    const std::string part = rest.substr(0, end);
    rest.erase(0, end + 1);
    const auto equals = std::min(part.find('='), part.size());
    const std::string value = part.substr(std::min(equals + 1, part.size()));
    if (Status set = set_part(address, part.substr(0, equals), value, text); !set) return failure(set);
  }
  return address;
}

Result<std::unique_ptr<PanTiltControl>> FlirPanTilt::open(const FlirAddress& address) {
  auto line = SerialLine::open(address.device, address.baud);
  if (!line) return failure(line);
  std::unique_ptr<FlirPanTilt> unit(new FlirPanTilt(std::move(*line), address));
  if (Status connected = unit->connect(); !connected) return failure(connected);
  return unit;
}

// Sends a command until an answer comes. The text of the answer.
Result<std::string> FlirPanTilt::ask(const std::string& text, bool wants_number) {
  std::string last;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    line_.discard_input();
    if (Status written = line_.write(text + " "); !written) return failure(written);
    const auto until = std::chrono::steady_clock::now() + kAnswerTime;
    for (;;) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
      if (left.count() <= 0) break;
      const auto line = line_.read_line(left);
      if (!line) return failure(line);
      if (!*line) break;
      last = **line;
      const auto answer = answer_in(last, text);
      if (!answer) continue;
      if (answer->refused) {
        return failure(ErrorCode::read_error, "the pan-tilt unit refuses '" + text + "': " + answer->text,
                       line_.device());
      }
      if (wants_number ? last_number(answer->text).has_value() : answer->text.empty()) return answer->text;
    }
  }
  return failure(
      ErrorCode::read_error,
      "the pan-tilt unit does not answer '" + text + "'" + (last.empty() ? "" : "; last line: '" + last + "'"),
      line_.device(), "check its power, the cable and the baud rate");
}

Status FlirPanTilt::command(const std::string& text) {
  const auto answer = ask(text, false);
  if (!answer) return failure(answer);
  return {};
}

Result<double> FlirPanTilt::query(const std::string& text) {
  const auto answer = ask(text, true);
  if (!answer) return failure(answer);
  return *last_number(*answer);
}

Status FlirPanTilt::connect() {
  if (!line_.is_open()) {
    auto again = SerialLine::open(line_.device(), baud_);
    if (!again) return failure(again);
    line_ = std::move(*again);
  }
  // The end of a command that was interrupted.
  if (Status written = line_.write(" "); !written) return written;
  for (const char* setting : {"ED", "FT", "I"}) {  // no echo, terse answers, motions begin at once
    if (Status done = command(setting); !done) return done;
  }
  for (Axis& axis : axes_) {
    if (Status done = connect_axis(axis); !done) return done;
  }
  connected_ = true;
  return {};
}

Status FlirPanTilt::connect_axis(Axis& axis) {
  const auto ask_axis = [&](char what) { return query(std::string{axis.name, what}); };
  const auto step = ask_axis('R'), least = ask_axis('N'), most = ask_axis('X'), desired = ask_axis('O');
  for (const auto* value : {&step, &least, &most, &desired}) {
    if (!*value) return failure(*value);
  }
  if (!(*step > 0) || !(*least < *most))
    return failure(ErrorCode::read_error, "the pan-tilt unit states impossible steps or limits", line_.device());
  axis.step_rad = *step * kSecondOfArc_rad;
  axis.least = std::lround(*least);
  axis.most = std::lround(*most);
  axis.target = std::lround(*desired);
  return set_speed(axis);
}

// A unit that lost its power has its own speed again.
Status FlirPanTilt::set_speed(const Axis& axis) {
  if (axis.deg_s == 0) return {};
  const auto least = query(std::string{axis.name, 'L'}), most = query(std::string{axis.name, 'U'});
  for (const auto* value : {&least, &most}) {
    if (!*value) return failure(*value);
  }
  const double step_deg = axis.step_rad / kDegree, steps_s = std::round(axis.deg_s / step_deg);
  if (!(steps_s >= *least && steps_s <= *most)) {
    return failure(
        ErrorCode::usage,
        fmt::format("a {} speed of {} deg/s is beyond the limits of the pan-tilt unit, {:.1f} to {:.1f} deg/s",
                    axis.name == 'P' ? "pan" : "tilt", axis.deg_s, *least * step_deg, *most * step_deg),
        line_.device());
  }
  return command(fmt::format("{}S{}", axis.name, std::lround(steps_s)));
}

Result<long> FlirPanTilt::position_of(const Axis& axis, double angle_rad) const {
  const double steps = axis.sign * angle_rad / axis.step_rad;
  if (steps >= static_cast<double>(axis.least) - 0.5 && steps <= static_cast<double>(axis.most) + 0.5)
    return std::lround(steps);
  const double one = axis.sign * axis.step_rad * static_cast<double>(axis.least) / kDegree,
               other = axis.sign * axis.step_rad * static_cast<double>(axis.most) / kDegree;
  return failure(
      ErrorCode::input,
      fmt::format("a {} of {:.1f} deg is beyond the limits of the pan-tilt unit, {:.1f} to {:.1f} deg",
                  axis.name == 'P' ? "pan" : "tilt", angle_rad / kDegree, std::min(one, other), std::max(one, other)),
      line_.device());
}

Status FlirPanTilt::move_to(const PanTiltAngles& angles) {
  if (!connected_) {
    if (Status again = connect(); !again) return again;
  }
  std::array<long, 2> targets{};
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const auto position = position_of(axes_[i], i == 0 ? angles.pan_rad : angles.tilt_rad);
    if (!position) return failure(position);
    targets[i] = *position;
  }
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    axes_[i].target = targets[i];
    if (Status sent = command(fmt::format("{}P{}", axes_[i].name, targets[i])); !sent) {
      connected_ = false;
      return sent;
    }
  }
  return {};
}

Result<PanTiltReading> FlirPanTilt::read() {
  PanTiltReading reading;
  for (const Axis& axis : axes_) {
    const auto position = query(std::string{axis.name, 'P'});
    if (!position) {
      connected_ = false;
      return failure(position);
    }
    (axis.name == 'P' ? reading.angles.pan_rad : reading.angles.tilt_rad) = axis.sign * *position * axis.step_rad;
    if (std::lround(*position) == axis.target) continue;
    reading.moves = true;
    const auto desired = query(std::string{axis.name, 'O'});
    if (desired && std::lround(*desired) == axis.target) continue;
    connected_ = false;
    if (!desired) return failure(desired);
    return failure(ErrorCode::read_error, "the pan-tilt unit was reset, as by a loss of power", line_.device());
  }
  return reading;
}

// A position is the nearest step: uniformly distributed within ±½ step.
double FlirPanTilt::sigma_rad() const {
  return std::max(axes_[0].step_rad, axes_[1].step_rad) / std::sqrt(12.0);
}

}  // namespace spartan::internal

namespace spartan {

Result<std::unique_ptr<PanTiltControl>> open_pan_tilt(const std::string& address) {
  constexpr std::string_view kFlir = "flir:";
  if (!address.starts_with(kFlir)) {
    return failure(ErrorCode::usage, "is not the address of a pan-tilt unit", address,
                   "use flir:DEVICE, for example flir:/dev/ttyUSB0");
  }
  const auto parsed = internal::parse_flir_address(address.substr(kFlir.size()));
  if (!parsed) return failure(parsed);
  return internal::FlirPanTilt::open(*parsed);
}

}  // namespace spartan
