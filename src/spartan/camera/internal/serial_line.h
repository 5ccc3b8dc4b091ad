// Lines of text over a serial line.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "spartan/core/result.h"

namespace spartan::internal {

/// A terminal device in raw mode, 8 data bits, no parity, 1 stop bit. It closes where it cannot be read or written, as
/// after it was unplugged.
class SerialLine {
 public:
  /// Codes: `usage` (no such rate), `read_error` (no such device).
  static Result<SerialLine> open(const std::string& device, int baud);
  SerialLine(SerialLine&& other) noexcept;
  SerialLine& operator=(SerialLine&& other) noexcept;
  SerialLine(const SerialLine&) = delete;
  SerialLine& operator=(const SerialLine&) = delete;
  ~SerialLine();

  const std::string& device() const { return device_; }
  bool is_open() const { return file_ >= 0; }
  void close();
  Status write(const std::string& text);
  /// The next line without its end (CR or LF); empty lines are skipped. Nothing where none ends before the timeout.
  /// Characters that are not printable are left out, and of a line longer than kLongestLine the begin.
  Result<std::optional<std::string>> read_line(std::chrono::milliseconds timeout);
  /// Discards what was received and not read.
  void discard_input();

  static constexpr std::size_t kLongestLine = 1000;

 private:
  SerialLine(std::string device, int file) : device_(std::move(device)), file_(file) {}
  tl::unexpected<Error> lost(const std::string& what);

  std::string device_;
  int file_ = -1;
  std::string received_;
};

}  // namespace spartan::internal
