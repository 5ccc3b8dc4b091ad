// One sink for what the library has to say to people.
#pragma once

#include <memory>
#include <string>
#include <string_view>

namespace spartan {

enum class LogLevel { debug, info, warning, error, off };

/// Where messages go: standard error, optionally a file too. A value that is handed on; copies share the sink.
/// A default-made Log says nothing.
class Log {
 public:
  Log() = default;
  /// Messages of at least `level` to standard error.
  static Log to_terminal(LogLevel level);
  /// This log, and everything from `info` up to the file too (appended). Where the file cannot be opened, this log.
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
