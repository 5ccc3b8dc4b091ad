#include "spartan/camera/internal/serial_line.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

namespace spartan::internal {
namespace {

std::optional<speed_t> speed_of(int baud) {
  constexpr std::array<std::pair<int, speed_t>, 7> kSpeeds{{{2400, B2400},
                                                            {4800, B4800},
                                                            {9600, B9600},
                                                            {19200, B19200},
                                                            {38400, B38400},
                                                            {57600, B57600},
                                                            {115200, B115200}}};
  for (const auto& [rate, speed] : kSpeeds) {
    if (rate == baud) return speed;
  }
  return std::nullopt;
}

Error system_error(const std::string& what, const std::string& device) {
  return failure(ErrorCode::read_error, what + ": " + std::system_category().message(errno), device).value();
}

// Takes the first whole line.
std::optional<std::string> take_line(std::string& received) {
  for (;;) {
    const auto end = received.find_first_of("\r\n");
    if (end == std::string::npos) return std::nullopt;
    std::string line;
    for (const char c : received.substr(0, end)) {
      if (c >= ' ' && c <= '~') line += c;
    }
    received.erase(0, end + 1);
    if (!line.empty()) return line;
  }
}

}  // namespace

Result<SerialLine> SerialLine::open(const std::string& device, int baud) {
  const auto speed = speed_of(baud);
  if (!speed) {
    return failure(ErrorCode::usage, fmt::format("{} baud is no rate of a serial line", baud), device,
                   "use 2400, 4800, 9600, 19200, 38400, 57600 or 115200");
  }
  const int file = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return tl::unexpected(system_error("cannot be opened", device));
  SerialLine line(device, file);
  termios settings{};
  if (::tcgetattr(file, &settings) != 0) return tl::unexpected(system_error("is no serial line", device));
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CSTOPB | CRTSCTS);
  ::cfsetispeed(&settings, *speed);
  ::cfsetospeed(&settings, *speed);
  if (::tcsetattr(file, TCSANOW, &settings) != 0) return tl::unexpected(system_error("cannot be set", device));
  return line;
}

SerialLine::SerialLine(SerialLine&& other) noexcept
    : device_(std::move(other.device_)), file_(std::exchange(other.file_, -1)), received_(std::move(other.received_)) {}

SerialLine& SerialLine::operator=(SerialLine&& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(file_, other.file_);
  std::swap(received_, other.received_);
  return *this;
}

SerialLine::~SerialLine() {
  close();
}

void SerialLine::close() {
  if (file_ >= 0) ::close(std::exchange(file_, -1));
}

tl::unexpected<Error> SerialLine::lost(const std::string& what) {
  auto error = system_error(what, device_);
  close();
  return tl::unexpected(std::move(error));
}

Status SerialLine::write(const std::string& text) {
  std::size_t written = 0;
  while (written < text.size()) {
    const ssize_t n = ::write(file_, text.data() + written, text.size() - written);
    if (n > 0) {
      written += static_cast<std::size_t>(n);
      continue;
    }
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && errno != EAGAIN) return lost("cannot be written");
    pollfd ready{file_, POLLOUT, 0};
    if (::poll(&ready, 1, 1000) == 0)
      return failure(ErrorCode::read_error, "takes no characters for a second", device_);
  }
  return {};
}

Result<std::optional<std::string>> SerialLine::read_line(std::chrono::milliseconds timeout) {
  const auto until = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    if (auto line = take_line(received_)) return line;
    if (received_.size() > kLongestLine) received_.resize(kLongestLine);
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
    pollfd ready{file_, POLLIN, 0};
    const int found = ::poll(&ready, 1, left.count() > 0 ? static_cast<int>(left.count()) : 0);
    if (found == 0) return std::optional<std::string>();
    if (found < 0 && errno == EINTR) continue;
    std::array<char, 256> bytes{};
    const ssize_t n = found < 0 ? -1 : ::read(file_, bytes.data(), bytes.size());
    if (n > 0) {
      received_.append(bytes.data(), static_cast<std::size_t>(n));
    } else if (n == 0 || (errno != EAGAIN && errno != EINTR)) {
      return lost("cannot be read; was it unplugged?");
    }
  }
}

void SerialLine::discard_input() {
  received_.clear();
  ::tcflush(file_, TCIFLUSH);
}

}  // namespace spartan::internal
