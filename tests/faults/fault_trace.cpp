#include "fault_trace.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>

#include "fault_plan.h"

namespace spartan::faults {
namespace {

std::atomic_flag tracing = ATOMIC_FLAG_INIT;

}  // namespace

bool traced(const char* path) {
  return plan.trace >= 0 && plan.folder != nullptr && std::strncmp(path, plan.folder, std::strlen(plan.folder)) == 0;
}

void trace(Change change, const char* path, const char* second, std::uint64_t inode, std::int64_t offset,
           const void* data, std::size_t bytes) {
  const int error = errno;
  Header header{change,
                static_cast<std::uint32_t>(std::strlen(path)),
                static_cast<std::uint32_t>(std::strlen(second)),
                static_cast<std::uint32_t>(bytes),
                inode,
                offset};
  const iovec parts[] = {{&header, sizeof header},
                         {const_cast<char*>(path), header.path_bytes},
                         {const_cast<char*>(second), header.second_path_bytes},
                         {const_cast<void*>(data), bytes}};
  while (tracing.test_and_set()) {
  }
  ::syscall(SYS_writev, plan.trace, parts, 4);
  tracing.clear();
  errno = error;
}

struct stat status_of(int file) {
  struct stat status {};
  ::fstat(file, &status);
  return status;
}

void trace_write(int file, const void* data, ssize_t written, std::int64_t offset) {
  if (plan.trace < 0 || written <= 0) return;
  const PathOf path(file);
  if (!traced(path.text)) return;
  if (offset < 0) offset = ::lseek(file, 0, SEEK_CUR) - written;
  trace(Change::write, path.text, "", status_of(file).st_ino, offset, data, static_cast<std::size_t>(written));
}

void trace_simple(int file, Change change, std::int64_t offset) {
  if (plan.trace < 0) return;
  const PathOf path(file);
  const struct stat status = status_of(file);
  if (S_ISDIR(status.st_mode) && change == Change::sync) change = Change::sync_folder;
  if (traced(path.text)) trace(change, path.text, "", status.st_ino, offset, nullptr, 0);
}

void trace_opened(int file, bool existed, bool truncated) {
  if (file < 0) return;
  if (!existed) trace_simple(file, Change::create);
  if (existed && truncated) trace_simple(file, Change::truncate);
}

bool exists(const char* path) {
  const int error = errno;
  const bool there = ::syscall(SYS_faccessat, AT_FDCWD, path, F_OK) == 0;
  errno = error;
  return there;
}

void trace_content(FILE* stream) {
  const PathOf path(::fileno(stream));
  if ((::fcntl(::fileno(stream), F_GETFL) & O_ACCMODE) == O_RDONLY || !traced(path.text)) return;
  const struct stat status = status_of(::fileno(stream));
  const auto bytes = static_cast<std::size_t>(status.st_size);
  const int file = raw_open(path.text, O_RDONLY);
  void* data = bytes == 0 ? MAP_FAILED : ::mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, file, 0);
  if (data != MAP_FAILED) {
    trace(Change::content, path.text, "", status.st_ino, 0, data, bytes);
    ::munmap(data, bytes);
  }
  ::syscall(SYS_close, file);
}

}  // namespace spartan::faults
