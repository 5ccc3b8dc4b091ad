// Reading files and FIFOs, writing files atomically, and owning a folder.
#pragma once

#include <chrono>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "spartan/core/result.h"

namespace spartan {

/// Maximum size of a file that is read as a whole: an image of 2^27 pixels with three samples of 16 bits each fits.
constexpr std::size_t kLargestFile_bytes = std::size_t{1} << 30U;

/// The content of a regular file of at most `largest` bytes. Codes: `input` (missing, a folder, a device, a pipe, or
/// too large), `read_error` (the system reports an error, e.g. EIO or EACCES), `resources` (no memory or file
/// descriptor). Part of a file is never returned as the whole.
Result<std::string> read_file(const std::string& path, std::size_t largest = kLargestFile_bytes);

/// The first `most` bytes of a regular file, or all of a shorter one. Codes as read_file().
Result<std::string> read_beginning(const std::string& path, std::size_t most);

/// A regular file that is open for reading from its beginning to its end. Codes of errors as read_file().
class InputFile {
 public:
  static Result<InputFile> open(const std::string& path);
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&& other) noexcept;
  ~InputFile();

  /// Size when it was opened, bytes.
  std::size_t size() const { return size_; }
  /// Reads up to `space.size()` bytes; fewer only at the end of the file. Returns their number.
  Result<std::size_t> read(std::span<char> space);

 private:
  InputFile(int descriptor, std::size_t size, std::string path)
      : descriptor_(descriptor), size_(size), path_(std::move(path)) {}
  int descriptor_ = -1;
  std::size_t size_ = 0;
  std::string path_;
};

/// Names of the entries of a folder, sorted, without "." and "..". Codes as read_file(): an error in the middle is not
/// taken for the end of the folder.
Result<std::vector<std::string>> list_folder(const std::string& path);

/// Maximum size of a calibration file; larger files are rejected before they are read.
constexpr std::size_t kLargestCalibration_bytes = std::size_t{4} << 20U;
/// Maximum size of mrcal's files, which may contain all inputs of the optimization.
constexpr std::size_t kLargestModelFile_bytes = std::size_t{64} << 20U;

/// The content of a file without a byte order mark; code `configuration` if it cannot be read or is too large.
Result<std::string> read_calibration_text(const std::string& path, std::size_t largest = kLargestCalibration_bytes);

/// Name of the temporary file of this process for `path`, in the same folder: NAME.PID.part.
std::string temporary_name(const std::string& path);

/// Removes the temporary files (NAME.PID.part) that processes which were killed left in a folder, not in the folders
/// below it. The caller owns the folder (FolderLock).
void remove_temporary_files(const std::string& folder);

/// Writes to a temporary file in the same folder, flushes it to the disk (fsync), renames it and flushes the folder: a
/// reader sees either the old content or the complete new one, also after a loss of power. Codes with the path:
/// `output` (permission, disk full, size limit; `path` is a folder, a FIFO or a device), `resources`.
Status write_file_atomically(const std::string& path, std::string_view content);

/// A file to write.
struct NewFile {
  std::string path;
  std::string_view content;
};
/// The same for files that belong together: all of them are on the disk before the first is renamed, so if one cannot
/// be written, the existing files remain unchanged.
Status write_files_atomically(const std::vector<NewFile>& files);

/// The error for a failed write, with a hint that depends on `error_number`, a value of errno: code `resources` if
/// memory or file descriptors ran out, else `output`.
tl::unexpected<Error> write_failure(const std::string& path, int error_number);

/// Flushes a finished temporary file, renames it to `path` and flushes the folder; the temporary file is removed if
/// that fails. Codes as write_file_atomically().
Status publish_file(const std::string& temporary, const std::string& path);

/// Flushes to the disk that files of the folder were created, renamed or removed. Where the folder may not be opened
/// for reading, nothing is flushed and nothing reported.
Status sync_folder(const std::string& path);

/// Creates the folder and its parents; code `output` or `resources` if that fails.
Status make_folder(const std::string& path);

/// Ownership of a folder by one process: a lock (flock) on the file `owner.lock` in it, which holds the id of the
/// process. The lock ends with the process, however that ends. The file is removed with the value.
class FolderLock {
 public:
  /// The `wait` of those who go on with the work of a killed process: it owns the folder until its write to the disk
  /// has returned and each of its threads had its turn, which takes seconds on a busy computer.
  static constexpr std::chrono::milliseconds kOfKilledProcess{10000};

  /// Waits for `wait` at most while another process owns the folder. The caller looks into the folder again after it
  /// has waited. Codes: `output` if the other process still owns it (its id is named) or the file cannot be written,
  /// `resources`.
  static Result<FolderLock> acquire(const std::string& folder,
                                    std::chrono::milliseconds wait = std::chrono::milliseconds(40));
  /// The error of acquire() if another process owns the folder for longer than `wait`; nothing if none does. Changes
  /// nothing in the folder. An empty folder is watched for half a second: the process that created it may be about to
  /// lock it.
  static Status expect_free(const std::string& folder, std::chrono::milliseconds wait = std::chrono::milliseconds(0));

  FolderLock() = default;  ///< owns nothing
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&& other) noexcept;
  ~FolderLock();

  bool owns() const { return descriptor_ >= 0; }

 private:
  FolderLock(int descriptor, std::string path) : descriptor_(descriptor), path_(std::move(path)) {}
  int descriptor_ = -1;
  std::string path_;  // of the file
};

/// A folder that a new one replaces. It is renamed to NAME.PID.replaced in the same parent, and comes back, in the
/// place of what was made since, unless discard() removes it.
class ReplacedFolder {
 public:
  /// Does nothing where `path` does not exist or is an empty folder. `known`: the names of all entries that such a
  /// folder may have. Code `output` for a folder with any other entry, a link, a file, the current folder or one around
  /// it, and if another process owns the folder.
  static Result<ReplacedFolder> set_aside(const std::string& path, std::span<const std::string_view> known);

  ReplacedFolder() = default;  ///< replaces nothing
  ReplacedFolder(ReplacedFolder&& other) noexcept;
  ReplacedFolder& operator=(ReplacedFolder&& other) noexcept;
  ~ReplacedFolder();

  /// The new folder stays; removes the former one.
  void discard();

 private:
  ReplacedFolder(std::string path, std::string aside) : path_(std::move(path)), aside_(std::move(aside)) {}
  void restore();
  std::string path_, aside_;
};

/// Reading end of a FIFO: bytes that other programs write now. Writers may come and go; there is no end.
class Fifo {
 public:
  /// Creates the FIFO where there is none. Code `output`: it cannot be created or opened, or is no FIFO.
  static Result<Fifo> open(const std::string& path);
  Fifo(Fifo&& other) noexcept;
  Fifo& operator=(Fifo&& other) noexcept;
  ~Fifo();

  /// Number of bytes that were there, at most those of `bytes`. Waits for the first one, at most for `timeout`.
  std::size_t read(std::span<char> bytes, std::chrono::milliseconds timeout = {});

 private:
  explicit Fifo(int file) : file_(file) {}

  int file_ = -1;
};

}  // namespace spartan
