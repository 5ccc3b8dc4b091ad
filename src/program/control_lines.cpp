#include "program/control_lines.h"

#include <array>

namespace spartan::program {
namespace {

constexpr std::size_t kLongestLine = 1000;

}  // namespace

Result<std::unique_ptr<ControlLines>> ControlLines::open(const std::string& fifo, const Log& log) {
  auto opened = Fifo::open(fifo);
  if (!opened) return failure(opened);
  return std::unique_ptr<ControlLines>(new ControlLines(std::move(*opened), log));
}

void ControlLines::receive() {
  std::array<char, 512> bytes{};
  for (;;) {
    const std::size_t n = fifo_.read(bytes);
    if (n == 0) return;
    received_.append(bytes.data(), n);
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
