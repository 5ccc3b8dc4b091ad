// Reading end of a FIFO: bytes that other programs write now.
#pragma once

#include <chrono>
#include <cstddef>
#include <span>
#include <string>

#include "spartan/core/result.h"

namespace spartan {

/// Writers may come and go; there is no end.
class Fifo {
 public:
  /// Creates the FIFO where there is none. Code `output`: it cannot be created or opened, or is no FIFO.
  static Result<Fifo> open(const std::string& path);
  Fifo(Fifo&& other) noexcept;
  Fifo& operator=(Fifo&& other) noexcept;
  ~Fifo();

  /// Number of bytes that were there, at most those of `bytes`. Waits for the first one, at most for `timeout`.
  std::size_t read(std::span<char> bytes, std::chrono::milliseconds timeout = {});

 private:
  explicit Fifo(int file) : file_(file) {}

  int file_ = -1;
};

}  // namespace spartan
