// Preloaded library (LD_PRELOAD) that makes calls of a program fail, slows them down, or traces what it writes.
// Environment variables:
//   FAULT_CALL    malloc, open, read, write, fsync or rename: the kind of call that is counted
//   FAULT_AT      number of the call that fails, from 1; without it calls are only counted
//   FAULT_FROM    if set, all later calls of the kind fail as well
//   FAULT_ERRNO   errno of the failing call
//   FAULT_PATH    only calls on files whose path contains this text are counted
//   FAULT_MIN     only allocations of at least this many bytes are counted
//   FAULT_DELAY   microseconds that each write and fsync takes longer
//   FAULT_CLOCK   if set, the real-time clock jumps by up to ±115 days at every call
//   FAULT_REPORT  file that gets a line "calls N injected M" when the program ends, and "injected" at each failing call
//   FAULT_TRACE, FAULT_TRACE_FOLDER  file that gets what happens to the files below a folder, for power_loss.py
// Calls count from the beginning of main(): what static libraries do before is not the program's.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* memory, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace {

enum Call { kNone, kMalloc, kOpen, kRead, kWrite, kFsync, kRename };

struct Plan {
  Call call = kNone;
  long at = 0, delay_us = 0;
  std::size_t least_bytes = 0;
  bool later_ones_too = false, clock_jumps = false;
  int error = EIO;
  std::array<char, PATH_MAX> path{}, report{}, trace_folder{};
  int trace = -1;
};

Plan plan;
std::atomic<bool> running{false};
std::atomic<long> calls{0}, injected{0};
std::atomic_flag tracing = ATOMIC_FLAG_INIT;

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

void say(const char* text, long first, long second) {
  if (plan.report[0] == 0) return;
  std::array<char, 128> line{};
  const int length = std::snprintf(line.data(), line.size(), text, first, second);
  const long file = syscall(SYS_openat, AT_FDCWD, plan.report.data(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (file < 0) return;
  static_cast<void>(syscall(SYS_write, file, line.data(), length));
  syscall(SYS_close, file);
}

// Counts a call; whether it is to fail.
bool is_due(Call call) {
  if (!running || plan.call != call) return false;
  const long number = ++calls;
  if (plan.at == 0 || number < plan.at || (number > plan.at && !plan.later_ones_too)) return false;
  if (++injected == 1) say("injected at call %ld of process %ld\n", number, getpid());
  errno = plan.error;
  return true;
}

bool has_path(const char* path) {
  return plan.path[0] == 0 || (path != nullptr && std::strstr(path, plan.path.data()) != nullptr);
}

// The path of an open file; empty for a pipe or a device.
struct PathOf {
  explicit PathOf(int file) {
    std::array<char, 64> link{};
    std::snprintf(link.data(), link.size(), "/proc/self/fd/%d", file);
    const ssize_t length = readlink(link.data(), text.data(), text.size() - 1);
    text[length > 0 ? static_cast<std::size_t>(length) : 0] = 0;
  }
  std::array<char, PATH_MAX> text{};
};

bool is_due_on_file(Call call, int file) {
  if (!running || plan.call != call) return false;
  return has_path(PathOf(file).text.data()) && is_due(call);
}

// A trace record: kind, two paths, offset, and bytes, each with its length in front (8 bytes).
void trace_bytes(const void* data, std::uint64_t size) {
  syscall(SYS_write, plan.trace, &size, sizeof size);
  const auto* bytes = static_cast<const char*>(data);
  while (size > 0) {
    const long written = syscall(SYS_write, plan.trace, bytes, size);
    if (written <= 0) return;
    bytes += written;
    size -= static_cast<std::uint64_t>(written);
  }
}
bool is_traced(const char* path) {
  return running && plan.trace >= 0 &&
         std::strncmp(path, plan.trace_folder.data(), std::strlen(plan.trace_folder.data())) == 0;
}
void trace(char kind, const char* path, const char* other, std::uint64_t offset, const void* data, std::size_t size) {
  if (!is_traced(path)) return;
  const int error = errno;
  while (tracing.test_and_set()) usleep(10);
  trace_bytes(&kind, 1);
  trace_bytes(path, std::strlen(path));
  trace_bytes(other, std::strlen(other));
  trace_bytes(&offset, sizeof offset);
  trace_bytes(data, size);
  tracing.clear();
  errno = error;
}
void trace_write(int file, const void* data, ssize_t written, std::int64_t offset) {
  if (plan.trace < 0 || written <= 0) return;
  trace('W', PathOf(file).text.data(), "", static_cast<std::uint64_t>(offset), data, static_cast<std::size_t>(written));
}

// The content of a file when it is flushed: what is written through other ways than write() is known then.
void trace_sync(int file) {
  if (plan.trace < 0) return;
  const PathOf path(file);
  if (!is_traced(path.text.data())) return;
  struct stat status {};
  fstat(file, &status);
  if (S_ISDIR(status.st_mode)) return trace('D', path.text.data(), "", 0, "", 0);
  const auto size = static_cast<std::size_t>(status.st_size);
  void* content = __libc_malloc(size + 1);
  const long source = syscall(SYS_openat, AT_FDCWD, path.text.data(), O_RDONLY | O_CLOEXEC, 0);
  std::size_t filled = 0;
  while (source >= 0 && filled < size) {
    const long count = syscall(SYS_read, source, static_cast<char*>(content) + filled, size - filled);
    if (count <= 0) break;
    filled += static_cast<std::size_t>(count);
  }
  if (source >= 0) syscall(SYS_close, source);
  trace('S', path.text.data(), "", 0, content, filled);
  free(content);
}

void copy_variable(const char* name, std::array<char, PATH_MAX>& to) {
  if (const char* value = std::getenv(name)) std::snprintf(to.data(), to.size(), "%s", value);
}
long number_of(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? 0 : std::atol(value);
}

void read_plan() {
  const char* call = std::getenv("FAULT_CALL");
  constexpr std::array<const char*, 7> kNames{"", "malloc", "open", "read", "write", "fsync", "rename"};
  for (std::size_t i = 1; call != nullptr && i < kNames.size(); ++i) {
    if (std::strcmp(call, kNames[i]) == 0) plan.call = static_cast<Call>(i);
  }
  plan.at = number_of("FAULT_AT");
  plan.delay_us = number_of("FAULT_DELAY");
  plan.least_bytes = static_cast<std::size_t>(number_of("FAULT_MIN"));
  plan.later_ones_too = std::getenv("FAULT_FROM") != nullptr;
  plan.clock_jumps = std::getenv("FAULT_CLOCK") != nullptr;
  plan.error = std::getenv("FAULT_ERRNO") != nullptr ? static_cast<int>(number_of("FAULT_ERRNO")) : EIO;
  copy_variable("FAULT_PATH", plan.path);
  copy_variable("FAULT_REPORT", plan.report);
  copy_variable("FAULT_TRACE_FOLDER", plan.trace_folder);
  if (const char* trace_file = std::getenv("FAULT_TRACE")) {
    plan.trace =
        static_cast<int>(syscall(SYS_openat, AT_FDCWD, trace_file, O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
  }
}

using Main = int (*)(int, char**, char**);
Main program_main = nullptr;

int main_with_faults(int argc, char** argv, char** environment) {
  read_plan();
  std::atexit([] {
    running = false;
    say("calls %ld injected %ld\n", calls, injected);
  });
  running = true;
  return program_main(argc, argv, environment);
}

void wait_for_disk() {
  if (running && plan.delay_us > 0) usleep(static_cast<useconds_t>(plan.delay_us));
}

std::int64_t clock_jump() {
  static std::atomic<std::uint64_t> state{88172645463325252U};
  std::uint64_t x = state;
  x ^= x << 13U;
  x ^= x >> 7U;
  x ^= x << 17U;
  state = x;
  return static_cast<std::int64_t>(x % 20'000'000) - 10'000'000;
}

int open_file(const char* name, const char* path, int flags, mode_t mode) {
  if (has_path(path) && is_due(kOpen)) return -1;
  const bool creates = plan.trace >= 0 && (flags & O_CREAT) != 0 && access(path, F_OK) != 0;
  const int file = next<int (*)(const char*, int, ...)>(name)(path, flags, mode);
  if (file >= 0 && creates) trace('C', PathOf(file).text.data(), "", 0, "", 0);
  if (file >= 0 && (flags & O_TRUNC) != 0 && plan.trace >= 0) trace('T', PathOf(file).text.data(), "", 0, "", 0);
  return file;
}

}  // namespace

// NOLINTBEGIN(readability-inconsistent-declaration-parameter-name): the names in the headers of the C library are
// reserved
extern "C" {

int __libc_start_main(Main main, int argc, char** argv, void (*init)(), void (*fini)(), void (*rtld_fini)(),
                      void* end) {
  program_main = main;
  using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);
  return next<Start>("__libc_start_main")(main_with_faults, argc, argv, init, fini, rtld_fini, end);
}

void* malloc(std::size_t size) {
  if (size >= plan.least_bytes && is_due(kMalloc)) return nullptr;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  if (count * size >= plan.least_bytes && is_due(kMalloc)) return nullptr;
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) {
  if (size >= plan.least_bytes && is_due(kMalloc)) return nullptr;
  return __libc_realloc(memory, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  if (size >= plan.least_bytes && is_due(kMalloc)) return nullptr;
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) {
  *memory = memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const auto mode = static_cast<mode_t>(va_arg(arguments, int));
  va_end(arguments);
  return open_file("open", path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const auto mode = static_cast<mode_t>(va_arg(arguments, int));
  va_end(arguments);
  return open_file("open64", path, flags, mode);
}

ssize_t read(int file, void* data, std::size_t size) {
  if (is_due_on_file(kRead, file)) return -1;
  return syscall(SYS_read, file, data, size);
}
ssize_t pread64(int file, void* data, std::size_t size, off64_t offset) {
  if (is_due_on_file(kRead, file)) return -1;
  return syscall(SYS_pread64, file, data, size, offset);
}
ssize_t pread(int file, void* data, std::size_t size, off_t offset) {
  return pread64(file, data, size, offset);
}

ssize_t write(int file, const void* data, std::size_t size) {
  wait_for_disk();
  if (is_due_on_file(kWrite, file)) return -1;
  const auto offset = plan.trace >= 0 ? lseek(file, 0, SEEK_CUR) : 0;
  const ssize_t written = syscall(SYS_write, file, data, size);
  trace_write(file, data, written, offset);
  return written;
}
ssize_t pwrite64(int file, const void* data, std::size_t size, off64_t offset) {
  wait_for_disk();
  if (is_due_on_file(kWrite, file)) return -1;
  const ssize_t written = syscall(SYS_pwrite64, file, data, size, offset);
  trace_write(file, data, written, offset);
  return written;
}
ssize_t pwrite(int file, const void* data, std::size_t size, off_t offset) {
  return pwrite64(file, data, size, offset);
}
int ftruncate64(int file, off64_t size) {
  const int result = static_cast<int>(syscall(SYS_ftruncate, file, size));
  if (result == 0 && plan.trace >= 0) trace('T', PathOf(file).text.data(), "", static_cast<std::uint64_t>(size), "", 0);
  return result;
}
int ftruncate(int file, off_t size) {
  return ftruncate64(file, size);
}
int fsync(int file) {
  wait_for_disk();
  if (is_due_on_file(kFsync, file)) return -1;
  trace_sync(file);
  return static_cast<int>(syscall(SYS_fsync, file));
}
int fdatasync(int file) {
  return fsync(file);
}

int rename(const char* from, const char* to) {
  if (has_path(to) && is_due(kRename)) return -1;
  const int result = static_cast<int>(syscall(SYS_rename, from, to));
  if (result == 0) trace('R', from, to, 0, "", 0);
  return result;
}
int unlink(const char* path) {
  const int result = static_cast<int>(syscall(SYS_unlink, path));
  if (result == 0) trace('U', path, "", 0, "", 0);
  return result;
}
int mkdir(const char* path, mode_t mode) {
  const int result = static_cast<int>(syscall(SYS_mkdir, path, mode));
  if (result == 0) trace('M', path, "", 0, "", 0);
  return result;
}

int clock_gettime(clockid_t clock, timespec* time) {
  const int result = static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  if (running && plan.clock_jumps && clock == CLOCK_REALTIME && result == 0) time->tv_sec += clock_jump();
  return result;
}
int gettimeofday(timeval* time, void*) {
  timespec now{};
  const int result = clock_gettime(CLOCK_REALTIME, &now);
  time->tv_sec = now.tv_sec;
  time->tv_usec = now.tv_nsec / 1000;
  return result;
}

}  // extern "C"
// NOLINTEND(readability-inconsistent-declaration-parameter-name)
