#include "program/publisher.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <utility>

namespace spartan::program {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view kTcp = "tcp:";
constexpr auto kPoll = 50ms;  // how often readers that come or go are noticed
constexpr auto kLastWrites = 500ms;
constexpr std::size_t kChunk = 4096;  // PIPE_BUF: where poll() reports space in a pipe, so much is written at once
constexpr int kMostReaders = 16;

std::string reason() {
  return std::strerror(errno);
}

}  // namespace

Result<std::unique_ptr<Publisher>> Publisher::open(const std::string& target) {
  std::unique_ptr<Publisher> publisher(new Publisher());
  Status opened;
  if (target == "-") {
    publisher->readers_.push_back({::dup(STDOUT_FILENO), {}});
    if (publisher->readers_.front().file < 0)
      opened = failure(ErrorCode::output, "cannot be written: " + reason(), "standard output");
  } else if (target.starts_with(kTcp)) {
    opened = publisher->listen_on(target.substr(kTcp.size()));
  } else {
    opened = publisher->open_fifo(target);
  }
  if (!opened) return failure(opened);
  publisher->thread_ = std::thread([p = publisher.get()] { p->run(); });
  return publisher;
}

Status Publisher::open_fifo(const std::string& path) {
  struct stat about {};
  if (::stat(path.c_str(), &about) != 0 || !S_ISFIFO(about.st_mode)) {
    return failure(ErrorCode::usage, "is not a FIFO", path,
                   "make one with mkfifo, or publish to - (standard output) or tcp:PORT");
  }
  fifo_ = path;
  return {};
}

// "PORT" or "ADDRESS:PORT". Without an address only processes of this computer can connect.
Status Publisher::listen_on(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  const std::string host = colon == std::string::npos ? "127.0.0.1" : address.substr(0, colon);
  const std::string port = colon == std::string::npos ? address : address.substr(colon + 1);
  int number = -1;
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), number);
  sockaddr_in name{};
  name.sin_family = AF_INET;
  if (error != std::errc() || end != port.data() + port.size() || number < 0 || number > 65535 ||
      ::inet_pton(AF_INET, host.c_str(), &name.sin_addr) != 1) {
    return failure(ErrorCode::usage, "is not a TCP port", "tcp:" + address, "use tcp:PORT or tcp:IPV4-ADDRESS:PORT");
  }
  name.sin_port = htons(static_cast<std::uint16_t>(number));
  listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  const int yes = 1;
  socklen_t size = sizeof name;
  if (listener_ < 0 || ::setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
      ::bind(listener_, reinterpret_cast<const sockaddr*>(&name), size) != 0 ||
      ::listen(listener_, kMostReaders) != 0 ||
      ::getsockname(listener_, reinterpret_cast<sockaddr*>(&name), &size) != 0) {
    return failure(ErrorCode::output, "cannot listen: " + reason(), "tcp:" + address);
  }
  port_ = ntohs(name.sin_port);
  is_tcp_ = true;
  return {};
}

Publisher::~Publisher() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
  while (!readers_.empty()) close_reader(0);
  if (listener_ >= 0) ::close(listener_);
}

void Publisher::publish(const std::string& line) {
  {
    const std::lock_guard lock(mutex_);
    lines_.push_back(line + "\n");
  }
  changed_.notify_one();
}

void Publisher::run() {
  const auto is_pending = [this] {
    return std::any_of(readers_.begin(), readers_.end(), [](const Reader& r) { return !r.pending.empty(); });
  };
  for (;;) {
    std::string text;
    std::int64_t count = 0;
    bool ended = false;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, is_pending() ? 0ms : kPoll, [this] { return ended_ || !lines_.empty(); });
      count = static_cast<std::int64_t>(lines_.size());
      for (const std::string& line : lines_) text += line;
      lines_.clear();
      ended = ended_;
    }
    connect();
    if (count > 0) append(text, count);
    write_pending(static_cast<int>(kPoll.count()));
    if (ended) break;
  }
  const auto deadline = std::chrono::steady_clock::now() + kLastWrites;
  while (is_pending() && std::chrono::steady_clock::now() < deadline) write_pending(static_cast<int>(kPoll.count()));
}

void Publisher::connect() {
  if (is_tcp_) {
    const int file = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    if (file < 0) return;
    if (static_cast<int>(readers_.size()) < kMostReaders) {
      readers_.push_back({file, {}});
    } else {
      ::close(file);
    }
  } else if (!fifo_.empty() && readers_.empty()) {
    // Fails while nobody reads.
    const int file = ::open(fifo_.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
    if (file >= 0) readers_.push_back({file, {}});
  }
}

void Publisher::append(const std::string& lines, std::int64_t count) {
  for (std::size_t i = readers_.size(); i-- > 0;) {
    if (readers_[i].pending.size() + lines.size() <= kMostPending) {
      readers_[i].pending += lines;
      continue;
    }
    discarded_ += count;
    if (is_tcp_) close_reader(i);
  }
}

// Writes once to each reader that is ready; a reader that is gone is closed.
void Publisher::write_pending(int timeout_ms) {
  std::vector<pollfd> polled;
  for (const Reader& reader : readers_) {
    if (!reader.pending.empty()) polled.push_back({reader.file, POLLOUT, 0});
  }
  if (polled.empty() || ::poll(polled.data(), polled.size(), timeout_ms) <= 0) return;
  for (const pollfd& ready : polled) {
    if (ready.revents == 0) continue;
    const auto reader =
        std::find_if(readers_.begin(), readers_.end(), [&](const Reader& r) { return r.file == ready.fd; });
    const ssize_t written = ::write(reader->file, reader->pending.data(), std::min(reader->pending.size(), kChunk));
    if (written >= 0) {
      reader->pending.erase(0, static_cast<std::size_t>(written));
    } else if (errno != EAGAIN && errno != EINTR) {
      close_reader(static_cast<std::size_t>(reader - readers_.begin()));
    }
  }
}

void Publisher::close_reader(std::size_t index) {
  if (readers_[index].file >= 0) ::close(readers_[index].file);
  readers_.erase(readers_.begin() + static_cast<std::ptrdiff_t>(index));
}

}  // namespace spartan::program
