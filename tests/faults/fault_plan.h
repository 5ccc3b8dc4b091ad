// What the environment asks fault_shim.cpp to inject, and the count of calls.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstddef>
#include <cstdint>

namespace spartan::faults {

enum class Call { none, malloc, open, read, write, fsync, rename };

struct Report {
  std::atomic<std::uint64_t> calls, injected, delays, clock_readings, main_reached, inside_gdal;
};

// Constant-initialized: malloc() is called before any constructor runs.
struct Plan {
  Call call = Call::none;
  std::uint64_t at = 0, min_bytes = 0;
  bool always = false;
  int error = ENOSPC, signal = 0;
  const char* path = nullptr;
  unsigned delay_us = 0;
  std::int64_t clock_s = 0;
  int trace = -1;
  const char* folder = nullptr;
};
extern Plan plan;
extern Report* report;
extern std::atomic<bool> in_main;  // faults are injected while main() runs only

// The path of an open file, empty if it has none.
struct PathOf {
  explicit PathOf(int file);
  char text[PATH_MAX];
};

int raw_open(const char* path, int flags);

// Counts a call of a kind, and tells whether it is to fail; errno is then set.
bool fails(Call call, const char* path, std::uint64_t bytes = 0);
bool fails(Call call, int file);

void delay(int file);

// By how many seconds the next reading of the real-time clock is off.
std::int64_t clock_error();

}  // namespace spartan::faults
