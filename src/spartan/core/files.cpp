#include "spartan/core/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace spartan {
namespace {

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

}  // namespace

tl::unexpected<Error> write_failure(const std::string& path, int error) {
  std::string hint = "check the permissions and the free disk space";
  if (error == ENOSPC) hint = "free disk space, or choose another folder with -o";
  if (error == EACCES || error == EROFS) hint = "choose a writable folder with -o";
  if (error == EFBIG) hint = "raise the file size limit (ulimit -f)";
  return failure(ErrorCode::output, std::string("cannot be written: ") + std::strerror(error), path, hint);
}

Result<std::string> read_file(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return failure(ErrorCode::input, "is a folder, not a file", path);
  std::ifstream file(path, std::ios::binary);
  if (!file) return failure(ErrorCode::input, std::string("cannot be read: ") + std::strerror(errno), path);
  std::stringstream content;
  content << file.rdbuf();
  if (file.bad()) return failure(ErrorCode::input, "cannot be read completely", path);
  return content.str();
}

Status write_file_atomically(const std::string& path, std::string_view content) {
  return write_files_atomically({{path, content}});
}

Status write_files_atomically(const std::vector<NewFile>& files) {
  std::vector<std::string> temporaries;
  const auto abort_with = [&](const std::string& path, int error) {
    for (const std::string& temporary : temporaries) ::unlink(temporary.c_str());
    return write_failure(path, error);
  };
  for (const NewFile& file : files) {
    std::error_code ignored;
    if (std::filesystem::is_directory(file.path, ignored)) return abort_with(file.path, EISDIR);
    const std::string temporary = file.path + ".part";
    const int opened = ::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
    if (opened < 0) return abort_with(file.path, errno);
    temporaries.push_back(temporary);
    int error = write_all(opened, file.content);
    if (::close(opened) != 0 && error == 0) error = errno;
    if (error != 0) return abort_with(file.path, error);
  }
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (::rename(temporaries[i].c_str(), files[i].path.c_str()) != 0) return abort_with(files[i].path, errno);
  }
  return {};
}

Status make_folder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error) return write_failure(path, error.value());
  return {};
}

}  // namespace spartan
