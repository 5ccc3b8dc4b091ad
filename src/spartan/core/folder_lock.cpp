#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include "spartan/core/files.h"

namespace spartan {
namespace {

constexpr const char* kLockFile = "/owner.lock";

// What another process does in a moment is waited for: kTries times kPause.
constexpr int kTries = 50;
constexpr std::chrono::milliseconds kPause(10);

// The id of a process in a lock file; empty if it is missing.
std::string id_in(int lock_file) {
  std::array<char, 32> buffer{};
  const ssize_t size = ::pread(lock_file, buffer.data(), buffer.size(), 0);
  const std::string_view content(buffer.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  return content.ends_with('\n') ? std::string(content.substr(0, content.find_first_not_of("0123456789")))
                                 : std::string();
}

// The id that the owner has written into its lock file, which has no name any more when the owner is about to end. It
// is written right after the file was locked, so it is waited for, but not long: the owner's disk may be full. Empty if
// it is missing.
std::string owner_of(int lock_file) {
  std::string id;
  for (int i = 0; i < kTries && (id = id_in(lock_file)).empty(); ++i) std::this_thread::sleep_for(kPause);
  return id;
}

tl::unexpected<Error> in_use(const std::string& folder, int lock_file) {
  const std::string owner = owner_of(lock_file);
  return failure(ErrorCode::output,
                 "is in use by another process" + (owner.empty() ? std::string() : " (id " + owner + ")"), folder,
                 "wait until it has finished, or choose another folder with -o");
}

// Whether the open file still has its name: the owner before may have removed it after this process opened it.
bool has_name(int descriptor, const std::string& path) {
  struct stat opened {
  }, named{};
  return ::fstat(descriptor, &opened) == 0 && ::stat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

// Whether there is more in the folder than a lock file, which may appear at any moment. True as well for a folder that
// does not exist.
bool has_content(const std::string& folder) {
  std::error_code error;
  std::filesystem::directory_iterator entry(folder, error);
  for (const std::filesystem::directory_iterator end; !error && entry != end; entry.increment(error)) {
    if ("/" + entry->path().filename().string() != kLockFile) return true;
  }
  return static_cast<bool>(error);
}

Status write_owner(int descriptor, const std::string& path) {
  const std::string id = std::to_string(::getpid()) + "\n";
  errno = 0;
  const bool written = ::ftruncate(descriptor, 0) == 0 &&
                       ::pwrite(descriptor, id.data(), id.size(), 0) == static_cast<ssize_t>(id.size());
  return written ? Status() : Status(write_failure(path, errno == 0 ? ENOSPC : errno));
}

}  // namespace

Status FolderLock::expect_free(const std::string& folder, std::chrono::milliseconds wait) {
  const std::string path = folder + kLockFile;
  const auto end = std::chrono::steady_clock::now() + wait;
  for (int i = 0; i < kTries;) {
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor < 0 && has_content(folder)) return {};
    if (descriptor >= 0) {
      const FolderLock opened(descriptor, "");
      // A shared lock is refused by an exclusive one; it ends with `opened`.
      if (::flock(descriptor, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        if (std::chrono::steady_clock::now() >= end) return in_use(folder, descriptor);
        std::this_thread::sleep_for(kPause);
        continue;
      }
      if (!id_in(descriptor).empty()) return {};  // left by a process that was killed
    }
    ++i;
    // Another process has created the folder or the file, and is about to lock it.
    std::this_thread::sleep_for(kPause);
  }
  return {};
}

Result<FolderLock> FolderLock::acquire(const std::string& folder, std::chrono::milliseconds wait) {
  const std::string path = folder + kLockFile;
  const auto end = std::chrono::steady_clock::now() + wait;
  for (;;) {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
    if (descriptor < 0) return write_failure(path, errno);
    FolderLock lock(descriptor, "");  // removes nothing yet
    int error = 0;
    do {
      error = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0 ? 0 : errno;
    } while (error == EINTR);
    // The lock may be that of expect_free() of another process, which ends in a moment.
    if (error == EWOULDBLOCK && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(kPause);
      continue;
    }
    if (error == EWOULDBLOCK) return in_use(folder, descriptor);
    if (error != 0) return write_failure(path, error);
    if (!has_name(descriptor, path)) continue;
    lock.path_ = path;
    if (Status written = write_owner(descriptor, path); !written) return failure(written);
    return lock;
  }
}

FolderLock::FolderLock(FolderLock&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), path_(std::move(other.path_)) {}
FolderLock& FolderLock::operator=(FolderLock&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(path_, other.path_);
  return *this;
}
FolderLock::~FolderLock() {
  if (descriptor_ < 0) return;
  if (!path_.empty() && has_name(descriptor_, path_)) ::unlink(path_.c_str());
  ::close(descriptor_);
}

}  // namespace spartan
