#include "program/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

namespace spartan::program {
namespace {

constexpr int kBarWidth = 30;
constexpr std::chrono::milliseconds kRedrawEvery{100};

// A full disk or a closed terminal does not end the work whose progress is shown. fmt::print() would throw.
void write(const std::string& text) {
  static_cast<void>(std::fputs(text.c_str(), stderr));
}

}  // namespace

Progress::Progress(bool quiet)
    : quiet_(quiet), terminal_(::isatty(STDERR_FILENO) == 1), start_(std::chrono::steady_clock::now()) {}

Progress::~Progress() {
  if (line_open_) std::fputc('\n', stderr);
}

std::string Progress::speed(int done, int total) const {
  const int here = done - first_;
  if (here < 1) return "";
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  std::string text = seconds > 0 ? fmt::format(", {:.1f} frames/s", here / seconds) : "";
  if (total <= done) return text;
  const int left = static_cast<int>(std::lround(seconds / here * (total - done)));
  return text +
         (left >= 60 ? fmt::format(", {} min {:02d} s left", left / 60, left % 60) : fmt::format(", {} s left", left));
}

void Progress::show(int done, int total, const std::string& note) {
  if (quiet_) return;
  if (first_ < 0) {
    first_ = done;
    start_ = std::chrono::steady_clock::now();
  }
  if (!terminal_) {
    const int tenth = total > 0 ? 10 * done / total : done / 100;
    if (tenth == last_tenth_) return;
    last_tenth_ = tenth;
    write(fmt::format("{}/{} {}{}\n", done, total, note, speed(done, total)));
    return;
  }
  const auto now = std::chrono::steady_clock::now();
  if ((total == 0 || done < total) && now - last_shown_ < kRedrawEvery) return;
  last_shown_ = now;
  const int filled = total > 0 ? std::clamp(kBarWidth * done / total, 0, kBarWidth) : 0;
  write(fmt::format("\r[{}{}] {}/{} {}{}\033[K", std::string(static_cast<std::size_t>(filled), '#'),
                    std::string(static_cast<std::size_t>(kBarWidth - filled), '.'), done, total, note,
                    speed(done, total)));
  std::fflush(stderr);
  line_open_ = true;
}

}  // namespace spartan::program
