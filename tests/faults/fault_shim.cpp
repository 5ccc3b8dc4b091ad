// Fault injection into an unchanged program: to be loaded with LD_PRELOAD.
//
// The environment says what fails. Faults are injected while main() runs only: allocations of static initializers and
// of exit handlers belong to third parties.
//   FAULT_CALL       malloc | open | read | write | fsync | rename: the calls that are counted
//   FAULT_AT         the n-th of them fails, n from 1; 0 counts only
//   FAULT_ALWAYS     1: the following ones fail, too
//   FAULT_ERRNO      number of the error (default ENOSPC; malloc: always ENOMEM)
//   FAULT_SIGNAL     number of a signal that the process sends itself instead of the failure
//   FAULT_PATH       counts calls on files only whose path contains this text
//   FAULT_MIN_BYTES  counts allocations of at least this size only
//   FAULT_DELAY_US   delay of each write and fsync of a file whose path contains FAULT_PATH: a slow disk
//   FAULT_CLOCK_S    each reading of the real-time clock is off by up to this many seconds
//   FAULT_TRACE      file that receives every change of files below FAULT_FOLDER, in order, with its bytes
//   FAULT_FOLDER     absolute path of that folder
//   FAULT_REPORT     file that receives the number of calls, injected faults, delays and clock readings, whether
//                    main() was reached, and whether GDAL made or caused the allocation that failed (6 x uint64); it
//                    is mapped, so the numbers survive a kill
//
// Calls between functions of the C library itself cannot be intercepted; what stdio writes is traced at fflush() and
// fclose().
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "fault_plan.h"
#include "fault_trace.h"

extern "C" {
void* __libc_malloc(std::size_t);                 // NOLINT(bugprone-reserved-identifier): the allocator of glibc itself
void* __libc_calloc(std::size_t, std::size_t);    // NOLINT(bugprone-reserved-identifier)
void* __libc_realloc(void*, std::size_t);         // NOLINT(bugprone-reserved-identifier)
void* __libc_memalign(std::size_t, std::size_t);  // NOLINT(bugprone-reserved-identifier)
}

using namespace spartan::faults;

namespace {

int open_file(int folder, const char* path, int flags, mode_t mode) {
  if (fails(Call::open, path)) return -1;
  const bool existed = plan.trace < 0 || (flags & O_CREAT) == 0 || exists(path);
  const int file = static_cast<int>(::syscall(SYS_openat, folder, path, flags, mode));
  if (plan.trace >= 0 && (flags & (O_CREAT | O_TRUNC)) != 0) trace_opened(file, existed, (flags & O_TRUNC) != 0);
  return file;
}

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(::dlsym(RTLD_NEXT, name));
}

using OpenStream = FILE* (*)(const char*, const char*);
FILE* open_stream(OpenStream original, const char* path, const char* mode) {
  if (fails(Call::open, path)) return nullptr;
  const bool existed = plan.trace < 0 || exists(path);
  FILE* stream = original(path, mode);
  if (stream != nullptr && plan.trace >= 0 && mode[0] != 'r') trace_opened(::fileno(stream), existed, mode[0] == 'w');
  return stream;
}

using Main = int (*)(int, char**, char**);
Main real_main = nullptr;

int watched_main(int argc, char** argv, char** environment) {
  report->main_reached = 1;
  in_main = true;
  const int code = real_main(argc, argv, environment);
  in_main = false;
  return code;
}

mode_t mode_argument(int flags, std::va_list arguments) {
  return (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, mode_t) : 0;
}

}  // namespace

// NOLINTBEGIN(readability-inconsistent-declaration-parameter-name): those of glibc are reserved.
extern "C" {

int __libc_start_main(Main main, int argc, char** argv, void (*init)(), void (*fini)(), void (*loader_fini)(),
                      void* stack_end) {
  real_main = main;
  using Start = int (*)(Main, int, char**, void (*)(), void (*)(), void (*)(), void*);
  return next<Start>("__libc_start_main")(watched_main, argc, argv, init, fini, loader_fini, stack_end);
}

void* malloc(std::size_t bytes) {
  return fails(Call::malloc, nullptr, bytes) ? nullptr : __libc_malloc(bytes);
}
void* calloc(std::size_t count, std::size_t bytes) {
  return fails(Call::malloc, nullptr, count * bytes) ? nullptr : __libc_calloc(count, bytes);
}
void* realloc(void* old, std::size_t bytes) {
  return fails(Call::malloc, nullptr, bytes) ? nullptr : __libc_realloc(old, bytes);
}
void* memalign(std::size_t alignment, std::size_t bytes) {
  return fails(Call::malloc, nullptr, bytes) ? nullptr : __libc_memalign(alignment, bytes);
}
void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  return memalign(alignment, bytes);
}
int posix_memalign(void** result, std::size_t alignment, std::size_t bytes) {
  void* memory = memalign(alignment, bytes);
  if (memory == nullptr) return ENOMEM;
  *result = memory;
  return 0;
}

int open(const char* path, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = mode_argument(flags, arguments);
  va_end(arguments);
  return open_file(AT_FDCWD, path, flags, mode);
}
int open64(const char* path, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = mode_argument(flags, arguments);
  va_end(arguments);
  return open_file(AT_FDCWD, path, flags, mode);
}
int openat(int folder, const char* path, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = mode_argument(flags, arguments);
  va_end(arguments);
  return open_file(folder, path, flags, mode);
}
int creat(const char* path, mode_t mode) {
  return open_file(AT_FDCWD, path, O_CREAT | O_WRONLY | O_TRUNC, mode);
}
FILE* fopen(const char* path, const char* mode) {
  return open_stream(next<OpenStream>("fopen"), path, mode);
}
FILE* fopen64(const char* path, const char* mode) {
  return open_stream(next<OpenStream>("fopen64"), path, mode);
}
int fflush(FILE* stream) {
  const int result = next<int (*)(FILE*)>("fflush")(stream);
  if (plan.trace >= 0 && stream != nullptr) trace_content(stream);
  return result;
}
int fclose(FILE* stream) {
  if (plan.trace >= 0) fflush(stream);
  return next<int (*)(FILE*)>("fclose")(stream);
}
DIR* opendir(const char* path) {
  return fails(Call::open, path) ? nullptr : next<DIR* (*)(const char*)>("opendir")(path);
}

ssize_t read(int file, void* data, std::size_t bytes) {
  return fails(Call::read, file) ? -1 : ::syscall(SYS_read, file, data, bytes);
}
ssize_t pread(int file, void* data, std::size_t bytes, off_t offset) {
  return fails(Call::read, file) ? -1 : ::syscall(SYS_pread64, file, data, bytes, offset);
}
ssize_t pread64(int file, void* data, std::size_t bytes, off_t offset) {
  return pread(file, data, bytes, offset);
}

ssize_t write(int file, const void* data, std::size_t bytes) {
  if (fails(Call::write, file)) return -1;
  delay(file);
  const ssize_t written = ::syscall(SYS_write, file, data, bytes);
  trace_write(file, data, written, -1);
  return written;
}
ssize_t writev(int file, const iovec* parts, int count) {
  if (fails(Call::write, file)) return -1;
  delay(file);
  ssize_t total = 0;
  for (int i = 0; i < count; ++i) {
    const ssize_t written = ::syscall(SYS_write, file, parts[i].iov_base, parts[i].iov_len);
    if (written < 0) return total > 0 ? total : -1;
    trace_write(file, parts[i].iov_base, written, -1);
    total += written;
    if (static_cast<std::size_t>(written) < parts[i].iov_len) break;
  }
  return total;
}
ssize_t pwrite(int file, const void* data, std::size_t bytes, off_t offset) {
  if (fails(Call::write, file)) return -1;
  delay(file);
  const ssize_t written = ::syscall(SYS_pwrite64, file, data, bytes, offset);
  trace_write(file, data, written, offset);
  return written;
}
ssize_t pwrite64(int file, const void* data, std::size_t bytes, off_t offset) {
  return pwrite(file, data, bytes, offset);
}
std::size_t fwrite(const void* data, std::size_t size, std::size_t count, FILE* stream) {
  if (fails(Call::write, ::fileno(stream))) return 0;
  return next<std::size_t (*)(const void*, std::size_t, std::size_t, FILE*)>("fwrite")(data, size, count, stream);
}
int ftruncate(int file, off_t bytes) {
  const int result = static_cast<int>(::syscall(SYS_ftruncate, file, bytes));
  if (result == 0) trace_simple(file, Change::truncate, bytes);
  return result;
}
int ftruncate64(int file, off_t bytes) {
  return ftruncate(file, bytes);
}

int fsync(int file) {
  if (fails(Call::fsync, file)) return -1;
  delay(file);
  const int result = static_cast<int>(::syscall(SYS_fsync, file));
  if (result == 0) trace_simple(file, Change::sync);
  return result;
}
int fdatasync(int file) {
  if (fails(Call::fsync, file)) return -1;
  delay(file);
  const int result = static_cast<int>(::syscall(SYS_fdatasync, file));
  if (result == 0) trace_simple(file, Change::sync);
  return result;
}

int rename(const char* from, const char* to) {
  if (fails(Call::rename, to)) return -1;
  const int result = static_cast<int>(::syscall(SYS_renameat, AT_FDCWD, from, AT_FDCWD, to));
  if (result == 0 && traced(to)) trace(Change::rename, from, to, 0, 0, nullptr, 0);
  return result;
}
int unlink(const char* path) {
  const int result = static_cast<int>(::syscall(SYS_unlinkat, AT_FDCWD, path, 0));
  if (result == 0 && traced(path)) trace(Change::unlink, path, "", 0, 0, nullptr, 0);
  return result;
}
int remove(const char* path) {
  if (unlink(path) == 0) return 0;
  return errno == EISDIR ? static_cast<int>(::syscall(SYS_unlinkat, AT_FDCWD, path, AT_REMOVEDIR)) : -1;
}
int mkdir(const char* path, mode_t mode) {
  const int result = static_cast<int>(::syscall(SYS_mkdirat, AT_FDCWD, path, mode));
  if (result == 0 && traced(path)) trace(Change::mkdir, path, "", 0, 0, nullptr, 0);
  return result;
}

int clock_gettime(clockid_t clock, timespec* time) {
  const int result = static_cast<int>(::syscall(SYS_clock_gettime, clock, time));
  if (plan.clock_s > 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) time->tv_sec += clock_error();
  return result;
}
int gettimeofday(timeval* time, void*) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  time->tv_sec = now.tv_sec;
  time->tv_usec = now.tv_nsec / 1000;
  return 0;
}
std::time_t time(std::time_t* result) {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (result != nullptr) *result = now.tv_sec;
  return now.tv_sec;
}

}  // extern "C"
// NOLINTEND(readability-inconsistent-declaration-parameter-name)
