#include "fault_plan.h"

#include <dlfcn.h>
#include <execinfo.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace spartan::faults {
namespace {

constexpr const char* kCallNames[] = {"", "malloc", "open", "read", "write", "fsync", "rename"};
Report no_report;

std::uint64_t number(const char* name) {
  const char* text = std::getenv(name);
  return text == nullptr ? 0 : std::strtoull(text, nullptr, 10);
}

bool counted_path(const char* path) {
  return plan.path == nullptr || (path != nullptr && std::strstr(path, plan.path) != nullptr);
}

}  // namespace

Plan plan;
Report* report = &no_report;
std::atomic<bool> in_main{false};

int raw_open(const char* path, int flags) {
  return static_cast<int>(::syscall(SYS_openat, AT_FDCWD, path, flags | O_CLOEXEC, 0644));
}

namespace {

__attribute__((constructor)) void read_environment() {
  if (const char* call = std::getenv("FAULT_CALL")) {
    for (int i = 1; i <= 6; ++i) {
      if (std::strcmp(call, kCallNames[i]) == 0) plan.call = static_cast<Call>(i);
    }
  }
  plan.at = number("FAULT_AT");
  plan.always = number("FAULT_ALWAYS") != 0;
  plan.min_bytes = number("FAULT_MIN_BYTES");
  if (const std::uint64_t error = number("FAULT_ERRNO")) plan.error = static_cast<int>(error);
  plan.signal = static_cast<int>(number("FAULT_SIGNAL"));
  plan.path = std::getenv("FAULT_PATH");
  plan.delay_us = static_cast<unsigned>(number("FAULT_DELAY_US"));
  plan.clock_s = static_cast<std::int64_t>(number("FAULT_CLOCK_S"));
  plan.folder = std::getenv("FAULT_FOLDER");
  if (const char* trace = std::getenv("FAULT_TRACE"))
    plan.trace = raw_open(trace, O_WRONLY | O_CREAT | O_TRUNC | O_APPEND);
  if (const char* path = std::getenv("FAULT_REPORT")) {
    const int file = raw_open(path, O_RDWR | O_CREAT);
    if (file >= 0 && ::ftruncate(file, sizeof(Report)) == 0) {
      void* mapped = ::mmap(nullptr, sizeof(Report), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
      if (mapped != MAP_FAILED) report = static_cast<Report*>(mapped);
    }
    ::syscall(SYS_close, file);
  }
}

// Whether a function of GDAL is among the callers.
bool inside_gdal() {
  std::array<void*, 128> callers{};
  const int count = ::backtrace(callers.data(), static_cast<int>(callers.size()));
  return std::any_of(callers.begin(), callers.begin() + count, [](const void* caller) {
    Dl_info about{};
    return ::dladdr(caller, &about) != 0 && std::strstr(about.dli_fname, "/libgdal") != nullptr;
  });
}

}  // namespace

PathOf::PathOf(int file) {
  char link[64];
  std::snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  const long length = ::syscall(SYS_readlinkat, AT_FDCWD, link, text, sizeof text - 1);
  text[length < 0 ? 0 : length] = '\0';
}

bool fails(Call call, const char* path, std::uint64_t bytes) {
  if (plan.call != call || !in_main.load(std::memory_order_relaxed)) return false;
  if (call == Call::malloc ? bytes < plan.min_bytes : !counted_path(path)) return false;
  const std::uint64_t n = report->calls.fetch_add(1) + 1;
  if (plan.at == 0 || (plan.always ? n < plan.at : n != plan.at)) return false;
  report->injected.fetch_add(1);
  if (call == Call::malloc && !plan.always && inside_gdal()) report->inside_gdal = 1;
  if (plan.signal != 0) {
    ::syscall(SYS_kill, ::getpid(), plan.signal);
    return false;
  }
  errno = call == Call::malloc ? ENOMEM : plan.error;
  return true;
}

bool fails(Call call, int file) {
  if (plan.call != call) return false;
  const int error = errno;
  const PathOf path(file);
  errno = error;
  return fails(call, path.text);
}

void delay(int file) {
  if (plan.delay_us == 0 || !in_main || !counted_path(PathOf(file).text)) return;
  report->delays.fetch_add(1);
  ::usleep(plan.delay_us);
}

std::int64_t clock_error() {
  const std::uint64_t n = report->clock_readings.fetch_add(1) + 1;
  const std::uint64_t mixed = n * 0x9E3779B97F4A7C15ULL >> 20U;
  return static_cast<std::int64_t>(mixed % static_cast<std::uint64_t>(2 * plan.clock_s + 1)) - plan.clock_s;
}

}  // namespace spartan::faults
