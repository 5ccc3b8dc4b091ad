#include "program/standard_error.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstddef>

namespace spartan::program {
namespace {

constexpr int kPoll_ms = 50;
constexpr std::chrono::milliseconds kFlush{500};

// Also where reading or writing would fail: a full pipe that nobody reads any more has an error, but no room.
bool is_ready(int file, short events) {
  pollfd poll{file, events, 0};
  return ::poll(&poll, 1, kPoll_ms) == 1;
}

}  // namespace

StandardErrorBuffer::StandardErrorBuffer() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0) return;
  standard_error_ = ::fcntl(STDERR_FILENO, F_DUPFD_CLOEXEC, 0);
  const bool replaced = standard_error_ >= 0 && ::dup2(ends[1], STDERR_FILENO) >= 0;
  ::close(ends[1]);
  pipe_ = ends[0];
  if (replaced) thread_ = std::thread([this] { copy(); });
}

StandardErrorBuffer::~StandardErrorBuffer() {
  if (thread_.joinable()) {
    flush();
    ::dup2(standard_error_, STDERR_FILENO);
    ended_ = true;
    thread_.join();
  }
  for (const int file : {standard_error_, pipe_}) {
    if (file >= 0) ::close(file);
  }
}

void StandardErrorBuffer::flush() const {
  const auto end = std::chrono::steady_clock::now() + kFlush;
  int waiting = 0;
  while (std::chrono::steady_clock::now() < end) {
    if (::ioctl(pipe_, FIONREAD, &waiting) == 0 && waiting == 0 && !copying_) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

void StandardErrorBuffer::copy() {
  std::array<char, PIPE_BUF> data{};
  while (!ended_) {
    if (!is_ready(pipe_, POLLIN)) continue;
    copying_ = true;
    const auto count = ::read(pipe_, data.data(), data.size());
    if (count > 0 && !write_out(data.data(), static_cast<std::size_t>(count))) return;
    copying_ = false;
  }
}

// A pipe that is ready takes PIPE_BUF bytes without waiting. The flags of the file are not changed: other processes
// share them. False where nobody will read it any more.
bool StandardErrorBuffer::write_out(const char* data, std::size_t size) const {
  while (size > 0 && !ended_) {
    if (!is_ready(standard_error_, POLLOUT)) continue;
    const auto count = ::write(standard_error_, data, size);
    if (count <= 0) return false;
    data += count;
    size -= static_cast<std::size_t>(count);
  }
  return true;
}

}  // namespace spartan::program
