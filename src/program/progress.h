// Progress on standard error: a bar with the time left on a terminal, plain lines in a pipe.
#pragma once

#include <chrono>
#include <string>

namespace spartan::program {

class Progress {
 public:
  /// Prints nothing if `quiet`.
  explicit Progress(bool quiet);
  /// Ends the line of the bar.
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// `done` and `total` count frames; `total` is 0 if unknown.
  void show(int done, int total, const std::string& note);

 private:
  /// ", 6.5 frames/s, 12 s left"
  std::string speed(int done, int total) const;

  bool quiet_;
  bool terminal_;
  bool line_open_ = false;
  int first_ = -1;  // `done` of the first call; a resumed run does not begin at 0
  int last_tenth_ = -1;
  std::chrono::steady_clock::time_point start_;
  std::chrono::steady_clock::time_point last_shown_;
};

}  // namespace spartan::program
