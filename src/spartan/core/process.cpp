#include <sys/resource.h>

#include <algorithm>
#include <charconv>
#include <ctime>
#include <fstream>
#include <limits>
#include <optional>
#include <string>

#include "spartan/core/stage_clock.h"

namespace spartan {
namespace {

std::optional<std::int64_t> number_in(const std::string& text) {
  const std::size_t begin = text.find_first_of("0123456789");
  if (begin == std::string::npos) return std::nullopt;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data() + begin, text.data() + text.size(), value);
  return error == std::errc() ? std::optional(value) : std::nullopt;
}

// The number in a file that holds one; none without the file or for "max".
std::optional<std::int64_t> number_in_file(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  return std::getline(file, line) ? number_in(line) : std::nullopt;
}

// The number in the line of a file that begins with `key`.
std::optional<std::int64_t> number_of_key(const std::string& path, const std::string& key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with(key)) return number_in(line.substr(key.size()));
  }
  return std::nullopt;
}

// What the limit of a control group leaves. Its usage includes page cache, of which the inactive part can be dropped.
std::optional<std::int64_t> left_in_group(const std::string& folder, const char* limit_file, const char* usage_file,
                                          const std::string& inactive_key) {
  const auto limit = number_in_file(folder + limit_file), used = number_in_file(folder + usage_file);
  if (!limit || !used) return std::nullopt;
  return *limit - *used + number_of_key(folder + "/memory.stat", inactive_key + " ").value_or(0);
}

// What `ulimit -v` leaves.
std::optional<std::int64_t> left_of_address_space() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return std::nullopt;
  const std::int64_t used = 1024 * number_of_key("/proc/self/status", "VmSize:").value_or(0);
  return static_cast<std::int64_t>(limit.rlim_cur) - used;
}

}  // namespace

Error out_of_memory(const std::bad_alloc& exception) {
  const auto* in_stage = dynamic_cast<const OutOfMemory*>(&exception);
  return {ErrorCode::resources,
          in_stage == nullptr ? std::string("out of memory")
                              : std::string("out of memory in the stage '") + in_stage->stage() + "'",
          "",
          "free memory, or use smaller images, a smaller disparity range or fewer threads; --resume continues a run"};
}

std::int64_t available_memory_bytes() {
  std::int64_t least = std::numeric_limits<std::int64_t>::max();
  if (const auto kilobytes = number_of_key("/proc/meminfo", "MemAvailable:")) least = 1024 * *kilobytes;
  for (const std::optional<std::int64_t> left :
       {left_in_group("/sys/fs/cgroup", "/memory.max", "/memory.current", "inactive_file"),
        left_in_group("/sys/fs/cgroup/memory", "/memory.limit_in_bytes", "/memory.usage_in_bytes",
                      "total_inactive_file"),
        left_of_address_space()}) {
    least = std::min(least, left.value_or(least));
  }
  return std::max<std::int64_t>(least, 1);
}

double cpu_seconds() {
  timespec t{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

std::int64_t peak_memory_bytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::int64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace spartan
