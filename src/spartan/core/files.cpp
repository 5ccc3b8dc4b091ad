#include "spartan/core/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
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
  if (error == ENOTDIR || error == EISDIR || error == EEXIST)
    hint = "a file stands where a folder is needed, or a folder where a file is";
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

Result<std::string> read_calibration_text(const std::string& path, std::size_t largest) {
  const auto error_at = [&](const std::string& what) { return failure(ErrorCode::configuration, what, path); };
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return error_at("is a folder, not a file");
  if (std::filesystem::exists(path, error) && !std::filesystem::is_regular_file(path, error)) {
    return error_at("is not a regular file: a calibration is read more than once, which a pipe does not allow");
  }
  const std::uintmax_t bytes = std::filesystem::file_size(path, error);
  if (!error && bytes > largest)
    return error_at("is larger than " + std::to_string(largest >> 20U) + " MB, so it is not a calibration file");
  std::ifstream file(path, std::ios::binary);
  if (!file) return error_at(std::string("cannot be read: ") + std::strerror(errno));
  std::string content;
  std::array<char, 65536> buffer{};
  while (file.read(buffer.data(), buffer.size()), file.gcount() > 0) {
    content.append(buffer.data(), static_cast<std::size_t>(file.gcount()));
    if (content.size() > largest)
      return error_at("is larger than " + std::to_string(largest >> 20U) + " MB, so it is not a calibration file");
  }
  if (file.bad()) return error_at("cannot be read completely");
  // Some editors write a UTF-8 byte order mark.
  if (content.starts_with("\xEF\xBB\xBF")) content.erase(0, 3);
  return content;
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
