// Commands for a run, as lines of text in a FIFO.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "spartan/core/files.h"
#include "spartan/core/log.h"
#include "spartan/core/result.h"
#include "spartan/system/run.h"

namespace spartan::program {

/// Reads "panorama" and "stop". Other lines change nothing: the first one is logged, and at the end their number.
/// Writers may come and go, and one that writes without end delays nothing.
class ControlLines {
 public:
  /// Codes as Fifo::open().
  static Result<std::unique_ptr<ControlLines>> open(const std::string& fifo, const Log& log);
  ~ControlLines();
  ControlLines(const ControlLines&) = delete;
  ControlLines& operator=(const ControlLines&) = delete;

  /// The next command; none where no whole line has arrived, and after kMostBytes. Does not wait.
  std::optional<RunCommand> next();

  static constexpr std::size_t kMostBytes = 65536;  ///< between two calls that return none: what a pipe holds
  static constexpr std::size_t kLongestLine = 1000;

 private:
  ControlLines(Fifo fifo, const Log& log) : fifo_(std::move(fifo)), log_(log) {}
  void receive();
  std::optional<std::string> take_line();
  void reject(const std::string& line);

  Fifo fifo_;
  Log log_;
  std::string received_;   // without what was taken
  std::size_t taken_ = 0;  // bytes at the begin of received_
  bool has_read_ = false;  // since a call returned none
  std::int64_t unknown_ = 0, too_long_ = 0;
  bool is_too_long_ = false;  // the line whose end has not arrived
};

}  // namespace spartan::program
