#include "spartan/testing/pan_tilt_emulator.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

namespace spartan::testing {

using Clock = std::chrono::steady_clock;

PanTiltEmulator::PanTiltEmulator(double steps_per_second) : own_speed_(steps_per_second), moved_(Clock::now()) {
  axes_[0] = {0, 0, -3090, 3090, own_speed_};
  axes_[1] = {0, 0, -907, 604, own_speed_};
  master_ = ::posix_openpt(O_RDWR | O_NOCTTY);
  if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0)
    throw std::runtime_error("no pseudo terminal");
  device_ = ::ptsname(master_);
  // Raw, so that nothing is echoed before the other side is opened.
  const int slave = ::open(device_.c_str(), O_RDWR | O_NOCTTY);
  termios settings{};
  ::tcgetattr(slave, &settings);
  ::cfmakeraw(&settings);
  ::tcsetattr(slave, TCSANOW, &settings);
  ::close(slave);
  thread_ = std::thread([this] { run(); });
}

PanTiltEmulator::~PanTiltEmulator() {
  ended_ = true;
  thread_.join();
  ::close(master_);
}

double PanTiltEmulator::position(char axis) const {
  const std::lock_guard lock(mutex_);
  return axes_[axis == 'P' ? 0 : 1].position;
}

double PanTiltEmulator::speed(char axis) const {
  const std::lock_guard lock(mutex_);
  return axes_[axis == 'P' ? 0 : 1].speed;
}

void PanTiltEmulator::refuse(const std::string& message) {
  const std::lock_guard lock(mutex_);
  refusal_ = message;
}

void PanTiltEmulator::lose_power(std::chrono::milliseconds silent) {
  const std::lock_guard lock(mutex_);
  silent_until_ = Clock::now() + silent;
  boots_ = true;
  echo_ = verbose_ = true;
  command_.clear();
  for (Axis& axis : axes_) axis.position = 0, axis.target = 0, axis.speed = own_speed_;
}

void PanTiltEmulator::run() {
  while (!ended_) {
    pollfd ready{master_, POLLIN, 0};
    ::poll(&ready, 1, 5);
    const std::lock_guard lock(mutex_);
    move();
    const bool silent = Clock::now() < silent_until_;
    if (!silent && boots_) {
      boots_ = false;
      send("\r\n*** PAN-TILT CONTROLLER v2.13 ***\r\nInitializing axes: pan tilt ok\r\n*");
    }
    if ((ready.revents & POLLIN) == 0) continue;
    char c = 0;
    if (::read(master_, &c, 1) == 1 && !silent) receive(c);
  }
}

void PanTiltEmulator::receive(char c) {
  if (echo_) send(std::string(1, c));
  if (c != ' ' && c != '\r' && c != '\n') {
    command_ += c;
    return;
  }
  if (!command_.empty()) execute(command_);
  command_.clear();
}

void PanTiltEmulator::execute(const std::string& command) {
  if (ignored_ > 0) {
    --ignored_;
    return;
  }
  if (garbage_ > 0) {
    --garbage_;
    send("\x01\xff~?x 77 *\r\n! \x02\rPQ* 12\r\n");
  }
  if (!refusal_.empty()) {
    send("! " + refusal_ + "\r\n");
    refusal_.clear();
    return;
  }
  send(answer_to(command) + "\r\n");
}

std::string PanTiltEmulator::query_result(const Axis& axis, const std::string& name) const {
  const char* const words = name[0] == 'P' ? "Pan" : "Tilt";
  const auto position = [&](const char* which, long value) {
    return "* " + (verbose_ ? fmt::format("{} {} position is {}", which, words, value) : std::to_string(value));
  };
  const auto speed = [&](const char* which, long value) {
    return "* " +
           (verbose_ ? fmt::format("{} {} speed is {} positions/sec", which, words, value) : std::to_string(value));
  };
  switch (name[1]) {
    case 'P':
      return position("Current", std::lround(axis.position));
    case 'O':
      return position("Target", axis.target);
    case 'N':
      return position("Minimum", axis.least);
    case 'X':
      return position("Maximum", axis.most);
    case 'S':
      return speed("Target", std::lround(axis.speed));
    case 'D':
      return speed("Current", axis.position == static_cast<double>(axis.target) ? 0 : std::lround(axis.speed));
    case 'L':
      return speed("Minimum", kSlowest);
    case 'U':
      return speed("Maximum", kFastest);
    case 'R':
      return fmt::format("* {}{}", kStep_arcsec, verbose_ ? " seconds arc per position" : "");
    default:
      return "! Illegal command";
  }
}

std::string PanTiltEmulator::answer_to(const std::string& command) {
  if (command == "ED" || command == "EE") {
    echo_ = command == "EE";
    return "*";
  }
  if (command == "FT" || command == "FV") {
    verbose_ = command == "FV";
    return "*";
  }
  if (command == "I") return "*";
  if (command.size() < 2 || (command[0] != 'P' && command[0] != 'T')) return "! Illegal command";
  if (command.size() == 2) return query_result(axes_[command[0] == 'P' ? 0 : 1], command);
  return execute_on(command[0], command[1], command.substr(2));
}

std::string PanTiltEmulator::execute_on(char name, char what, const std::string& number) {
  Axis& axis = axes_[name == 'P' ? 0 : 1];
  const char* const words = name == 'P' ? "Pan" : "Tilt";
  const long value = std::strtol(number.c_str(), nullptr, 10);
  if (what == 'S') {
    if (value > kFastest) return fmt::format("! {} speed cannot exceed {} positions/sec", words, kFastest);
    if (value < kSlowest) return fmt::format("! Motor speed cannot be less than {} pos/sec", kSlowest);
    axis.speed = static_cast<double>(value);
    return "*";
  }
  if (what != 'P') return "! Illegal command";
  if (value < axis.least || value > axis.most) {
    return fmt::format("! {} allowable {} position is {}", value < 0 ? "Minimum" : "Maximum", words,
                       value < 0 ? axis.least : axis.most);
  }
  axis.target = value;
  return "*";
}

void PanTiltEmulator::move() {
  const auto now = Clock::now();
  const double seconds = std::chrono::duration<double>(now - moved_).count();
  moved_ = now;
  for (Axis& axis : axes_) {
    const double most = axis.speed * seconds;
    axis.position += std::clamp(static_cast<double>(axis.target) - axis.position, -most, most);
  }
}

void PanTiltEmulator::send(const std::string& text) const {
  static_cast<void>(!::write(master_, text.data(), text.size()));
}

}  // namespace spartan::testing
