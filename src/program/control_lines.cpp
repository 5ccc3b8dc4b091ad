#include "program/control_lines.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

namespace spartan::program {
namespace {

constexpr std::size_t kLongestLine = 1000;

}  // namespace

Result<std::unique_ptr<ControlLines>> ControlLines::open(const std::string& fifo, const Log& log) {
  const auto failed = [&](const std::string& what) {
    return failure(ErrorCode::output, what + ": " + std::system_category().message(errno), fifo);
  };
  if (::mkfifo(fifo.c_str(), S_IRUSR | S_IWUSR) != 0 && errno != EEXIST) return failed("cannot be created");
  struct stat status {};
  if (::stat(fifo.c_str(), &status) != 0) return failed("cannot be opened");
  if (!S_ISFIFO(status.st_mode))
    return failure(ErrorCode::output, "exists and is no FIFO", fifo, "remove it, or name another path");
  // Also for writing: there is no end of the file when a writer goes.
  const int file = ::open(fifo.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return failed("cannot be opened");
  return std::unique_ptr<ControlLines>(new ControlLines(file, log));
}

ControlLines::~ControlLines() {
  ::close(file_);
}

void ControlLines::receive() {
  std::array<char, 512> bytes{};
  for (;;) {
    const ssize_t n = ::read(file_, bytes.data(), bytes.size());
    if (n <= 0) return;
    received_.append(bytes.data(), static_cast<std::size_t>(n));
    if (received_.size() > kLongestLine && received_.find('\n') == std::string::npos) received_.clear();
  }
}

std::optional<RunCommand> ControlLines::next() {
  receive();
  for (;;) {
    const auto end = received_.find('\n');
    if (end == std::string::npos) return std::nullopt;
    std::string line = received_.substr(0, end);
    received_.erase(0, end + 1);
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line == "panorama") return RunCommand::panorama;
    if (line == "stop") return RunCommand::stop;
    log_.warning("'" + line + "' is no command of a run: panorama or stop");
  }
}

}  // namespace spartan::program
