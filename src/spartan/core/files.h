// Reading files, and writing them atomically.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/core/result.h"

namespace spartan {

/// The content of a file; code `input` if it cannot be read.
Result<std::string> read_file(const std::string& path);

/// Maximum size of a calibration file; larger files are rejected before they are read.
constexpr std::size_t kLargestCalibration_bytes = std::size_t{4} << 20U;
/// Maximum size of mrcal's files, which may contain all inputs of the optimization.
constexpr std::size_t kLargestModelFile_bytes = std::size_t{64} << 20U;

/// The content of a file without a byte order mark; code `configuration` if it cannot be read or is too large.
Result<std::string> read_calibration_text(const std::string& path, std::size_t largest = kLargestCalibration_bytes);

/// Writes to a temporary file in the same folder, flushes it to the disk (fsync) and renames it: a reader sees either
/// the old content or the complete new one. Code `output` (permission, disk full, size limit) with the path.
Status write_file_atomically(const std::string& path, std::string_view content);

/// A file to write.
struct NewFile {
  std::string path;
  std::string_view content;
};
/// The same for files that belong together: all of them are on the disk before the first is renamed, so if one cannot
/// be written, the existing files remain unchanged.
Status write_files_atomically(const std::vector<NewFile>& files);

/// The error of code `output` for a failed write, with a hint that depends on `error_number`, a value of errno.
tl::unexpected<Error> write_failure(const std::string& path, int error_number);

/// Creates the folder and its parents; code `output` if that fails.
Status make_folder(const std::string& path);

}  // namespace spartan
