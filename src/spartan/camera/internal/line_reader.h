// Lines of a text file or of a text in memory, read in constant memory.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "spartan/core/files.h"
#include "spartan/core/result.h"

namespace spartan::internal {

/// Reads a text line by line. Of a line longer than kLongestLine_bytes only a part is
/// delivered, marked as too long.
class LineReader {
 public:
  static constexpr std::size_t kLongestLine_bytes = std::size_t{1} << 20U;

  /// Opens a regular file. Codes as read_file().
  static Result<LineReader> open(const std::string& path);
  static LineReader over(std::string text);

  struct Line {
    std::string_view text;     ///< without the newline, valid until the next call
    bool has_newline = false;  ///< false: the text ends here without one
    bool is_too_long = false;
  };
  /// The next line; nothing at the end. Codes of errors as read_file().
  Result<std::optional<Line>> next();

 private:
  explicit LineReader(std::optional<InputFile> file) : file_(std::move(file)) {}
  Status fill();

  std::optional<InputFile> file_;  // none: all of the text is in the buffer
  std::string buffer_;
  std::size_t begin_ = 0;  // of what is not yet delivered
  bool at_end_ = false;    // nothing follows what is in the buffer
};

}  // namespace spartan::internal
