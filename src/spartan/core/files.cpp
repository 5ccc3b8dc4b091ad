#include "spartan/core/files.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>

namespace spartan {
namespace {

constexpr const char* kTooLarge = "is larger than ";

bool is_shortage(int error) {
  return error == ENOMEM || error == EMFILE || error == ENFILE || error == EAGAIN;
}

tl::unexpected<Error> read_failure(const std::string& path, int error) {
  const std::string what = std::string("cannot be read: ") + std::strerror(error);
  if (is_shortage(error))
    return failure(ErrorCode::resources, what, path, "free memory or raise the limits (ulimit -v, ulimit -n)");
  const bool absent = error == ENOENT || error == ENOTDIR || error == ELOOP || error == ENAMETOOLONG || error == ENXIO;
  return failure(absent ? ErrorCode::input : ErrorCode::read_error, what, path,
                 error == EACCES ? "check the permissions" : "");
}

// Returns 0, or errno of the first call that failed.
int write_all(int file, std::string_view content) {
  while (!content.empty()) {
    const ssize_t written = ::write(file, content.data(), content.size());
    if (written < 0) {
      if (errno == EINTR) continue;
      return errno;
    }
    content.remove_prefix(static_cast<std::size_t>(written));
  }
  return ::fsync(file) == 0 ? 0 : errno;
}

// Whether the name has the form of temporary_name(): NAME.PID.part.
bool is_temporary_name(std::string_view name) {
  constexpr std::string_view kEnd = ".part";
  if (!name.ends_with(kEnd)) return false;
  name.remove_suffix(kEnd.size());
  const std::size_t dot = name.find_last_not_of("0123456789");
  return dot != std::string_view::npos && dot > 0 && name[dot] == '.' && dot + 1 < name.size();
}

std::string folder_of(const std::string& path) {
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

Status flush_and_rename(const std::string& temporary, const std::string& path) {
  const int opened = ::open(temporary.c_str(), O_WRONLY | O_CLOEXEC);
  if (opened < 0) return write_failure(path, errno);
  const int error = ::fsync(opened) == 0 ? 0 : errno;
  ::close(opened);
  if (error != 0) return write_failure(path, error);
  if (::rename(temporary.c_str(), path.c_str()) != 0) return write_failure(path, errno);
  return sync_folder(folder_of(path));
}

// A rename would replace a FIFO or a device, even /dev/null.
Status expect_replaceable(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0 || S_ISREG(status.st_mode)) return {};
  if (S_ISDIR(status.st_mode)) return write_failure(path, EISDIR);
  return failure(ErrorCode::output, "is not a regular file and is not replaced", path, "choose another path with -o");
}

}  // namespace

tl::unexpected<Error> write_failure(const std::string& path, int error) {
  std::string hint = "check the permissions and the free disk space";
  if (error == ENOSPC) hint = "free disk space, or choose another folder with -o";
  if (error == ENOENT) hint = "create its parent folder first, or choose another one";
  if (error == EACCES || error == EROFS) hint = "choose a writable folder with -o";
  if (error == ENOTDIR || error == EISDIR || error == EEXIST)
    hint = "a file stands where a folder is needed, or a folder where a file is";
  if (error == EFBIG) hint = "raise the file size limit (ulimit -f)";
  if (is_shortage(error)) hint = "free memory or raise the limits (ulimit -v, ulimit -n)";
  return failure(is_shortage(error) ? ErrorCode::resources : ErrorCode::output,
                 std::string("cannot be written: ") + std::strerror(error), path, hint);
}

Result<InputFile> InputFile::open(const std::string& path) {
  // O_NONBLOCK: opening a pipe that nobody writes to would wait for ever.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return read_failure(path, errno);
  InputFile file(descriptor, 0, path);
  struct stat status {};
  if (::fstat(descriptor, &status) != 0) return read_failure(path, errno);
  if (S_ISDIR(status.st_mode)) return failure(ErrorCode::input, "is a folder, not a file", path);
  if (!S_ISREG(status.st_mode)) {
    return failure(ErrorCode::input, "is not a regular file", path, "save a pipe or a device to a file first");
  }
  file.size_ = static_cast<std::size_t>(status.st_size);
  return file;
}

InputFile::InputFile(InputFile&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)), size_(other.size_), path_(std::move(other.path_)) {}
InputFile& InputFile::operator=(InputFile&& other) noexcept {
  std::swap(descriptor_, other.descriptor_);
  std::swap(size_, other.size_);
  std::swap(path_, other.path_);
  return *this;
}
InputFile::~InputFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<std::size_t> InputFile::read(std::span<char> space) {
  std::size_t filled = 0;
  while (filled < space.size()) {
    const ssize_t count = ::read(descriptor_, space.data() + filled, space.size() - filled);
    if (count == 0) break;
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return read_failure(path_, errno);
    filled += static_cast<std::size_t>(count);
  }
  return filled;
}

Result<std::string> read_file(const std::string& path, std::size_t largest) {
  auto file = InputFile::open(path);
  if (!file) return failure(file);
  // One byte more than the size: a file that grows meanwhile is read on.
  std::string content;
  std::size_t filled = 0;
  for (std::size_t space = file->size() + 1;; space = 2 * content.size()) {
    if (filled > largest || file->size() > largest) {
      return failure(ErrorCode::input, kTooLarge + std::to_string(largest >> 20U) + " MB", path);
    }
    content.resize(std::min(space, largest + 1));
    const auto count = file->read(std::span(content).subspan(filled));
    if (!count) return failure(count);
    filled += *count;
    if (filled < content.size()) break;
  }
  content.resize(filled);
  return content;
}

Result<std::string> read_beginning(const std::string& path, std::size_t most) {
  auto file = InputFile::open(path);
  if (!file) return failure(file);
  std::string content(std::min(most, file->size()), '\0');
  const auto count = file->read(content);
  if (!count) return failure(count);
  content.resize(*count);
  return content;
}

Result<std::string> read_calibration_text(const std::string& path, std::size_t largest) {
  auto content = read_file(path, largest);
  if (!content && content.error().code == ErrorCode::resources) return failure(content);
  if (!content) {
    Error error = std::move(content).error();
    error.code = ErrorCode::configuration;
    if (error.what.starts_with(kTooLarge)) error.what += ", so it is not a calibration file";
    return tl::unexpected(std::move(error));
  }
  // Some editors write a UTF-8 byte order mark.
  if (content->starts_with("\xEF\xBB\xBF")) content->erase(0, 3);
  return content;
}

// Not by std::filesystem::directory_iterator: in libstdc++ it ends the program where memory runs out.
Result<std::vector<std::string>> list_folder(const std::string& path) {
  const std::unique_ptr<DIR, int (*)(DIR*)> folder(::opendir(path.c_str()), &::closedir);
  if (!folder) return read_failure(path, errno);
  std::vector<std::string> names;
  for (;;) {
    errno = 0;
    const dirent* const entry = ::readdir(folder.get());
    if (entry == nullptr) break;
    const std::string_view name = entry->d_name;
    if (name != "." && name != "..") names.emplace_back(name);
  }
  if (errno != 0) return read_failure(path, errno);
  std::sort(names.begin(), names.end());
  return names;
}

std::string temporary_name(const std::string& path) {
  return path + "." + std::to_string(::getpid()) + ".part";
}

void remove_temporary_files(const std::string& folder) {
  for (const std::string& name : list_folder(folder).value_or(std::vector<std::string>())) {
    const std::filesystem::path path = folder / std::filesystem::path(name);
    std::error_code ignored;
    if (is_temporary_name(name) && std::filesystem::is_regular_file(path, ignored))
      std::filesystem::remove(path, ignored);
  }
}

Status write_file_atomically(const std::string& path, std::string_view content) {
  return write_files_atomically({{path, content}});
}

Status write_files_atomically(const std::vector<NewFile>& files) {
  std::vector<std::string> temporaries;
  const auto abandoned = [&](Status status) {
    for (const std::string& temporary : temporaries) ::unlink(temporary.c_str());
    return status;
  };
  for (const NewFile& file : files) {
    if (Status replaceable = expect_replaceable(file.path); !replaceable) return abandoned(std::move(replaceable));
    const std::string temporary = temporary_name(file.path);
    const int opened = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (opened < 0) return abandoned(write_failure(file.path, errno));
    temporaries.push_back(temporary);
    int error = write_all(opened, file.content);
    if (::close(opened) != 0 && error == 0) error = errno;
    if (error != 0) return abandoned(write_failure(file.path, error));
  }
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (::rename(temporaries[i].c_str(), files[i].path.c_str()) != 0)
      return abandoned(write_failure(files[i].path, errno));
  }
  std::vector<std::string> folders;
  folders.reserve(files.size());
  for (const NewFile& file : files) folders.push_back(folder_of(file.path));
  std::sort(folders.begin(), folders.end());
  folders.erase(std::unique(folders.begin(), folders.end()), folders.end());
  for (const std::string& folder : folders) {
    if (Status synced = sync_folder(folder); !synced) return synced;
  }
  return {};
}

Status publish_file(const std::string& temporary, const std::string& path) {
  Status status = expect_replaceable(path);
  if (status) status = flush_and_rename(temporary, path);
  if (!status) ::unlink(temporary.c_str());
  return status;
}

Status sync_folder(const std::string& path) {
  const int opened = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (opened < 0) return errno == EACCES ? Status() : Status(write_failure(path, errno));
  // EINVAL: a file system that cannot flush folders.
  const int error = ::fsync(opened) == 0 || errno == EINVAL ? 0 : errno;
  ::close(opened);
  if (error != 0) return write_failure(path, error);
  return {};
}

Status make_folder(const std::string& path) {
  namespace fs = std::filesystem;
  std::vector<std::string> parents;  // of the folders that are created
  std::error_code error;
  for (fs::path level(path); !level.empty() && !fs::exists(level, error); level = level.parent_path()) {
    if (error) return write_failure(path, error.value());
    parents.push_back(folder_of(level.string()));
    if (level == level.parent_path()) break;
  }
  fs::create_directories(path, error);
  if (error) return write_failure(path, error.value());
  for (const std::string& parent : parents) {
    if (Status synced = sync_folder(parent); !synced) return synced;
  }
  return {};
}

}  // namespace spartan
