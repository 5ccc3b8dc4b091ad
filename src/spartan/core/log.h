// Logging to standard error, to a file, or to a function.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace spartan {

enum class LogLevel { debug, info, warning, error, off };

/// A logger that is passed by value; copies share their sinks. A default-constructed Log discards all messages.
class Log {
 public:
  Log() = default;
  /// Messages of at least `level` to standard error.
  static Log to_terminal(LogLevel level);
  /// All messages to a function, which may be called by any thread, one call at a time.
  static Log to_function(std::function<void(LogLevel, std::string_view)> function);
  /// This log with an additional file sink (appended, level `info` and above). If the file cannot be opened, the result
  /// equals this log.
  Log with_file(const std::string& path) const;

  void debug(std::string_view text) const { write(LogLevel::debug, text); }
  void info(std::string_view text) const { write(LogLevel::info, text); }
  void warning(std::string_view text) const { write(LogLevel::warning, text); }
  void error(std::string_view text) const { write(LogLevel::error, text); }

 private:
  struct Sink;
  void write(LogLevel level, std::string_view text) const;
  std::shared_ptr<Sink> sink_;
};

}  // namespace spartan
