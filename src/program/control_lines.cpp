#include "program/control_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

namespace spartan::program {
namespace {

constexpr std::size_t kMostLogged = 60;  // characters of a line

// What a terminal shows without executing it.
std::string printable_beginning(const std::string& line) {
  std::string text = line.substr(0, kMostLogged);
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return line.size() > kMostLogged ? text + "…" : text;
}

}  // namespace

Result<std::unique_ptr<ControlLines>> ControlLines::open(const std::string& fifo, const Log& log) {
  auto opened = Fifo::open(fifo);
  if (!opened) return failure(opened);
  return std::unique_ptr<ControlLines>(new ControlLines(std::move(*opened), log));
}

ControlLines::~ControlLines() {
  if (unknown_ > 1) log_.warning(fmt::format("{} lines of the control FIFO were no commands", unknown_));
  if (too_long_ > 1) {
    log_.warning(fmt::format("{} lines of the control FIFO were longer than {} characters", too_long_, kLongestLine));
  }
}

void ControlLines::receive() {
  received_.erase(0, taken_);
  taken_ = 0;
  std::array<char, 4096> bytes{};
  for (std::size_t total = 0; total < kMostBytes;) {
    const std::size_t n = fifo_.read(bytes);
    if (n == 0) return;
    received_.append(bytes.data(), n);
    total += n;
  }
}

// The next line without its end. One that is too long is left out with its rest, which must not be taken for a line.
std::optional<std::string> ControlLines::take_line() {
  for (;;) {
    const std::size_t end = received_.find('\n', taken_);
    const bool is_whole = end != std::string::npos;
    const std::size_t size = (is_whole ? end : received_.size()) - taken_;
    const bool is_rest = is_too_long_;
    is_too_long_ = is_rest || size > kLongestLine;
    if (!is_whole && !is_too_long_) return std::nullopt;
    std::string line = received_.substr(taken_, is_too_long_ ? 0 : size);
    taken_ = is_whole ? end + 1 : received_.size();
    if (is_too_long_ && !is_rest && ++too_long_ == 1)
      log_.warning(fmt::format("a line of the control FIFO is longer than {} characters", kLongestLine));
    if (!is_whole) return std::nullopt;
    if (std::exchange(is_too_long_, false)) continue;
    if (!line.empty() && line.back() == '\r') line.pop_back();
    return line;
  }
}

void ControlLines::reject(const std::string& line) {
  if (++unknown_ == 1)
    log_.warning(fmt::format("'{}' is no command of a run: panorama or stop", printable_beginning(line)));
}

std::optional<RunCommand> ControlLines::next() {
  for (;;) {
    auto line = take_line();
    if (!line && !has_read_) {
      has_read_ = true;
      receive();
      line = take_line();
    }
    if (!line) {
      has_read_ = false;
      return std::nullopt;
    }
    if (*line == "panorama") return RunCommand::panorama;
    if (*line == "stop") return RunCommand::stop;
    reject(*line);
  }
}

}  // namespace spartan::program
