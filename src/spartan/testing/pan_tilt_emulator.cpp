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
  const auto result = [&](const std::string& what, const std::string& value) {
    return "* " + (verbose_ ? fmt::format("{} {} is {}", what, words, value) : value);
  };
  switch (name[1]) {
    case 'P':
      return result("Current", std::to_string(std::lround(axis.position)));
    case 'D':
      return result("Target", std::to_string(axis.target));
    case 'N':
      return result("Minimum", std::to_string(axis.least));
    case 'X':
      return result("Maximum", std::to_string(axis.most));
    case 'S':
      return result("Target speed of", std::to_string(std::lround(axis.speed)));
    case 'L':
      return result("Minimum speed of", std::to_string(kSlowest));
    case 'U':
      return result("Maximum speed of", std::to_string(kFastest));
    case 'R':
      return "* " + (verbose_ ? fmt::format("Resolution of {} in seconds arc per position is {}", words, kStep_arcsec)
                              : fmt::format("{}", kStep_arcsec));
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
  Axis& axis = axes_[command[0] == 'P' ? 0 : 1];
  if (command.size() == 2) return query_result(axis, command);
  return execute_on(axis, command[1], command.substr(2));
}

std::string PanTiltEmulator::execute_on(Axis& axis, char what, const std::string& number) {
  const long value = std::strtol(number.c_str(), nullptr, 10);
  if (what == 'S') {
    if (value < kSlowest || value > kFastest) return "! Speed cannot be set";
    axis.speed = static_cast<double>(value);
    return "*";
  }
  if (what != 'P') return "! Illegal command";
  if (value < axis.least || value > axis.most)
    return fmt::format("! Maximum allowable position is {}", value < 0 ? axis.least : axis.most);
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
