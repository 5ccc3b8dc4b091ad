// The fuzzer's input as a memory file, for parsers that open a path.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <string>

namespace spartan::testing {

class InputFile {
 public:
  InputFile(const std::uint8_t* data, std::size_t size) : handle_(::memfd_create("input", 0)) {
    if (handle_ < 0 || ::write(handle_, data, size) != static_cast<ssize_t>(size)) __builtin_trap();
  }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;
  ~InputFile() { ::close(handle_); }
  std::string path() const { return "/proc/self/fd/" + std::to_string(handle_); }

 private:
  int handle_;
};

}  // namespace spartan::testing
