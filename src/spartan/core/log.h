// Logging to standard error, to a file, or to a function.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace spartan {

enum class LogLevel { debug, info, warning, error, off };

class LogFile;

/// A logger that is passed by value; copies share their sinks. A default-constructed Log discards all messages.
class Log {
 public:
  Log() = default;
  /// Messages of at least `level` to standard error.
  static Log to_terminal(LogLevel level);
  /// All messages to a function, which may be called by any thread, one call at a time.
  static Log to_function(std::function<void(LogLevel, std::string_view)> function);
  /// Messages of this log and of all its copies go to a file as well (appended, level `info` and above), as long as the
  /// result exists. Nothing changes if the file cannot be opened.
  LogFile attach_file(const std::string& path);

  void debug(std::string_view text) const { write(LogLevel::debug, text); }
  void info(std::string_view text) const { write(LogLevel::info, text); }
  void warning(std::string_view text) const { write(LogLevel::warning, text); }
  void error(std::string_view text) const { write(LogLevel::error, text); }

 private:
  friend class LogFile;
  struct Sink;
  void write(LogLevel level, std::string_view text) const;
  std::shared_ptr<Sink> sink_;
};

/// A file that is attached to a log.
class LogFile {
 public:
  LogFile() = default;
  ~LogFile();
  LogFile(LogFile&&) = default;
  LogFile& operator=(LogFile&&) = delete;

 private:
  friend class Log;
  struct File;
  std::shared_ptr<Log::Sink> sink_;
  std::shared_ptr<File> file_;
};

}  // namespace spartan
