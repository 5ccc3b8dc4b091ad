// Commands for a run, as lines of text in a FIFO.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "spartan/core/files.h"
#include "spartan/core/log.h"
#include "spartan/core/result.h"
#include "spartan/system/run.h"

namespace spartan::program {

/// Reads "panorama" and "stop"; other lines are logged. Writers may come and go.
class ControlLines {
 public:
  /// Codes as Fifo::open().
  static Result<std::unique_ptr<ControlLines>> open(const std::string& fifo, const Log& log);

  /// The next command; none where no whole line has arrived. Does not wait.
  std::optional<RunCommand> next();

 private:
  ControlLines(Fifo fifo, const Log& log) : fifo_(std::move(fifo)), log_(log) {}
  void receive();

  Fifo fifo_;
  Log log_;
  std::string received_;
};

}  // namespace spartan::program
