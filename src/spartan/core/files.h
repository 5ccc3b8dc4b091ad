// Files written whole or not at all.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "spartan/core/result.h"

namespace spartan {

/// The whole of a file; code `input` where it cannot be read.
Result<std::string> read_file(const std::string& path);

/// Writes under a temporary name in the same folder, flushes to the disk and renames: a reader sees the old
/// content or the new one, never a part. Code `output` (permission, disk full, size limit) with the path.
Status write_file_atomically(const std::string& path, std::string_view content);

struct NewFile {
  std::string path;
  std::string_view content;
};
/// The same for files that belong together: all are on the disk before the first is renamed, so that what is there
/// already stays where one of them cannot be written.
Status write_files_atomically(const std::vector<NewFile>& files);

/// The error of code `output` for a failed write: `error_number` is what errno said.
tl::unexpected<Error> write_failure(const std::string& path, int error_number);

/// Makes the folder and its parents; code `output`.
Status make_folder(const std::string& path);

}  // namespace spartan
