#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "spartan/core/files.h"

namespace spartan {

Result<Fifo> Fifo::open(const std::string& path) {
  const auto failed = [&](const std::string& what) {
    return failure(ErrorCode::output, what + ": " + std::system_category().message(errno), path);
  };
  if (::mkfifo(path.c_str(), S_IRUSR | S_IWUSR) != 0 && errno != EEXIST) return failed("cannot be created");
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) return failed("cannot be opened");
  if (!S_ISFIFO(status.st_mode))
    return failure(ErrorCode::output, "exists and is no FIFO", path, "remove it, or name another path");
  // Also for writing: there is no end of the file when a writer goes.
  const int file = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return failed("cannot be opened");
  return Fifo(file);
}

Fifo::Fifo(Fifo&& other) noexcept : file_(std::exchange(other.file_, -1)) {}

Fifo& Fifo::operator=(Fifo&& other) noexcept {
  std::swap(file_, other.file_);
  return *this;
}

Fifo::~Fifo() {
  if (file_ >= 0) ::close(file_);
}

std::size_t Fifo::read(std::span<char> bytes, std::chrono::milliseconds timeout) {
  pollfd file{file_, POLLIN, 0};
  if (timeout.count() > 0) static_cast<void>(::poll(&file, 1, static_cast<int>(timeout.count())));
  const ssize_t n = ::read(file_, bytes.data(), bytes.size());
  return n > 0 ? static_cast<std::size_t>(n) : 0;
}

}  // namespace spartan
