#include "spartan/core/log.h"

#include <spdlog/logger.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/basic_file_sink.h>
#include <spdlog/sinks/dist_sink.h>
#include <spdlog/sinks/stdout_color_sinks.h>

#include <cstdlib>
#include <mutex>
#include <utility>
#include <vector>

namespace spartan {
namespace {

spdlog::level::level_enum to_spdlog(LogLevel level) {
  switch (level) {
    case LogLevel::debug:
      return spdlog::level::debug;
    case LogLevel::info:
      return spdlog::level::info;
    case LogLevel::warning:
      return spdlog::level::warn;
    case LogLevel::error:
      return spdlog::level::err;
    case LogLevel::off:
      return spdlog::level::off;
  }
  return spdlog::level::info;
}

std::shared_ptr<spdlog::sinks::sink> terminal_sink(LogLevel level) {
  auto sink = std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
  sink->set_level(to_spdlog(level));
  sink->set_pattern("%^%l%$: %v");
  const char* const no_colour = std::getenv("NO_COLOR");  // https://no-color.org
  if (no_colour != nullptr && *no_colour != '\0') sink->set_color_mode(spdlog::color_mode::never);
  return sink;
}

LogLevel from_spdlog(spdlog::level::level_enum level) {
  if (level <= spdlog::level::debug) return LogLevel::debug;
  if (level == spdlog::level::info) return LogLevel::info;
  return level == spdlog::level::warn ? LogLevel::warning : LogLevel::error;
}

class FunctionSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit FunctionSink(std::function<void(LogLevel, std::string_view)> function) : function_(std::move(function)) {}

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    function_(from_spdlog(message.level), {message.payload.data(), message.payload.size()});
  }
  void flush_() override {}
  std::function<void(LogLevel, std::string_view)> function_;
};

}  // namespace

struct Log::Sink {
  explicit Sink(std::vector<spdlog::sink_ptr> first)
      : sinks(std::make_shared<spdlog::sinks::dist_sink_mt>(std::move(first))), logger("spartan", sinks) {
    logger.set_level(spdlog::level::debug);
    logger.flush_on(spdlog::level::info);
    logger.set_error_handler([](const std::string&) {});  // a full disk must not print an error for each message
  }
  std::shared_ptr<spdlog::sinks::dist_sink_mt> sinks;
  spdlog::logger logger;
};

struct LogFile::File {
  spdlog::sink_ptr sink;
};

LogFile::~LogFile() {
  if (file_) sink_->sinks->remove_sink(file_->sink);
}

Log Log::to_terminal(LogLevel level) {
  Log log;
  log.sink_ = std::make_shared<Sink>(std::vector<spdlog::sink_ptr>{terminal_sink(level)});
  return log;
}

Log Log::to_function(std::function<void(LogLevel, std::string_view)> function) {
  Log log;
  log.sink_ =
      std::make_shared<Sink>(std::vector<spdlog::sink_ptr>{std::make_shared<FunctionSink>(std::move(function))});
  return log;
}

LogFile Log::attach_file(const std::string& path) {
  if (!sink_) sink_ = std::make_shared<Sink>(std::vector<spdlog::sink_ptr>());
  LogFile attached;
  try {
    auto file = std::make_shared<spdlog::sinks::basic_file_sink_mt>(path);
    file->set_level(spdlog::level::info);
    file->set_pattern("%Y-%m-%dT%H:%M:%S.%e %l: %v");
    attached.file_ = std::make_shared<LogFile::File>(LogFile::File{file});
    attached.sink_ = sink_;
    sink_->sinks->add_sink(std::move(file));
  } catch (const spdlog::spdlog_ex&) {
    // As documented, the other sinks are kept.
  }
  return attached;
}

void Log::write(LogLevel level, std::string_view text) const {
  if (sink_) sink_->logger.log(to_spdlog(level), "{}", text);
}

}  // namespace spartan
