#include "spartan/camera/internal/line_reader.h"

#include <span>
#include <utility>

namespace spartan::internal {
namespace {

constexpr std::size_t kBlock_bytes = 65536;

}  // namespace

Result<LineReader> LineReader::open(const std::string& path) {
  auto file = InputFile::open(path);
  if (!file) return failure(file);
  return LineReader(std::move(*file));
}

LineReader LineReader::over(std::string text) {
  LineReader reader(std::nullopt);
  reader.buffer_ = std::move(text);
  reader.at_end_ = true;
  return reader;
}

// Appends a block of the file to what is not yet delivered.
Status LineReader::fill() {
  buffer_.erase(0, std::exchange(begin_, 0));
  const std::size_t kept = buffer_.size();
  buffer_.resize(kept + kBlock_bytes);
  const auto count = file_->read(std::span(buffer_).subspan(kept));
  buffer_.resize(kept + count.value_or(0));
  if (!count) return failure(count);
  at_end_ = *count < kBlock_bytes;
  return {};
}

Result<std::optional<LineReader::Line>> LineReader::next() {
  std::size_t searched = 0;  // bytes after begin_ that hold no newline
  bool is_too_long = false;
  for (;;) {
    const std::size_t newline = buffer_.find('\n', begin_ + searched);
    if (newline != std::string::npos || at_end_) {
      if (newline == std::string::npos && begin_ == buffer_.size() && !is_too_long) return std::nullopt;
      const std::size_t end = newline == std::string::npos ? buffer_.size() : newline;
      const std::string_view text(buffer_.data() + begin_, end - begin_);
      begin_ = newline == std::string::npos ? end : end + 1;
      is_too_long = is_too_long || text.size() > kLongestLine_bytes;
      return Line{text.substr(0, kLongestLine_bytes), newline != std::string::npos, is_too_long};
    }
    searched = buffer_.size() - begin_;
    if (searched > kLongestLine_bytes) {
      is_too_long = true;
      begin_ = buffer_.size();
      searched = 0;
    }
    if (Status filled = fill(); !filled) return failure(filled);
  }
}

}  // namespace spartan::internal
