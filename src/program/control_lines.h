// Commands for a run, as lines of text in a FIFO.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "spartan/core/log.h"
#include "spartan/core/result.h"
#include "spartan/system/run.h"

namespace spartan::program {

/// Reads "panorama" and "stop"; other lines are logged. Writers may come and go.
class ControlLines {
 public:
  /// Creates the FIFO where there is none. Code `output`: it cannot be created or opened, or is no FIFO.
  static Result<std::unique_ptr<ControlLines>> open(const std::string& fifo, const Log& log);
  ~ControlLines();
  ControlLines(const ControlLines&) = delete;
  ControlLines& operator=(const ControlLines&) = delete;

  /// The next command; none where no whole line has arrived. Does not wait.
  std::optional<RunCommand> next();

 private:
  ControlLines(int file, const Log& log) : file_(file), log_(log) {}
  void receive();

  int file_;
  Log log_;
  std::string received_;
};

}  // namespace spartan::program
