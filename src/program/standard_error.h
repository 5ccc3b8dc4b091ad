// Standard error of a live run: a terminal or pipe that hangs does not delay the threads that write to it.
#pragma once

#include <atomic>
#include <chrono>
#include <thread>

namespace spartan::program {

/// As long as it exists, what is written to standard error goes to a pipe, which a thread empties into the old standard
/// error. What does not fit, where nobody reads there, is lost. Nothing changes where no pipe can be made.
class StandardErrorBuffer {
 public:
  StandardErrorBuffer();
  /// As flush().
  ~StandardErrorBuffer();
  StandardErrorBuffer(const StandardErrorBuffer&) = delete;
  StandardErrorBuffer& operator=(const StandardErrorBuffer&) = delete;

  /// Waits until what was written before has left the pipe, for at most half a second. By any thread.
  void flush() const;

 private:
  void copy();
  bool write_out(const char* data, std::size_t size) const;

  int standard_error_ = -1, pipe_ = -1;
  std::atomic<bool> ended_ = false, copying_ = false;
  std::thread thread_;
};

}  // namespace spartan::program
