// Parser of OpenCV's XML: <opencv_storage> <KEY> text </KEY> … , a matrix with <rows>, <cols> and <data> inside.
#include <fmt/format.h>

#include <algorithm>

#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/calibration_io/internal/opencv_storage.h"

namespace spartan::internal {
namespace {

using Entries = std::map<std::string, OpencvStorage::Entry>;

// Reads the tags in one pass, with an explicit stack of open tags.
class XmlReader {
 public:
  explicit XmlReader(const std::string& text) : text_(text) {}

  /// An error message; empty on success.
  std::string run() {
    while (true) {
      const std::size_t tag = text_.find('<', at_);
      take_text(tag);
      if (tag == std::string::npos) return open_.empty() && closed_ ? "" : "is truncated: </opencv_storage> is missing";
      if (std::string error = take_tag(tag); !error.empty()) return error;
    }
  }
  int line() const { return line_; }

  Entries entries;

 private:
  void move_to(std::size_t place) {
    for (; at_ < std::min(place, text_.size()); ++at_) line_ += text_[at_] == '\n' ? 1 : 0;
  }

  // Words inside a key or inside a part of a matrix.
  void take_text(std::size_t end) {
    const std::string words = text_.substr(at_, end == std::string::npos ? end : end - at_);
    move_to(end);
    if (open_.size() < 2 || open_.size() > 3) return;
    OpencvStorage::Entry& entry = entries[open_[1]];
    for (std::string word : split_words(words)) {
      if (word.size() > 1 && word.front() == '"' && word.back() == '"') word = word.substr(1, word.size() - 2);
      if (open_.size() == 2 || open_[2] == "data") entry.words.push_back(word);
      if (open_.size() == 3 && open_[2] == "rows") entry.rows = word;
      if (open_.size() == 3 && open_[2] == "cols") entry.columns = word;
    }
  }

  std::string take_tag(std::size_t tag) {
    const bool comment = text_.compare(tag, 4, "<!--") == 0;
    const std::string closing = comment ? "-->" : ">";
    const std::size_t end = text_.find(closing, tag);
    if (end == std::string::npos) return "unterminated tag";
    const std::string inside = text_.substr(tag + 1, end - tag - 1);
    const std::string name = inside.substr(0, inside.find_first_of(" \t\r\n/", inside.starts_with('/') ? 1 : 0));
    std::string error;
    if (inside.starts_with('/')) {
      error = close(name.substr(1));
    } else if (!comment && !inside.starts_with('?') && !inside.starts_with('!')) {
      error = open(name);
      if (error.empty() && inside.ends_with('/')) error = close(name);
    }
    if (error.empty()) move_to(end + closing.size());
    return error;
  }

  std::string open(const std::string& name) {
    if (closed_) return "has content after </opencv_storage>";
    if (open_.empty() && name != "opencv_storage") return "must begin with <opencv_storage>";
    if (open_.size() == 1 && !entries.try_emplace(name, OpencvStorage::Entry{line_, "", "", {}}).second) {
      return name.substr(0, 40) + ": is given twice";
    }
    open_.push_back(name);
    return "";
  }

  std::string close(const std::string& name) {
    if (open_.empty() || open_.back() != name) return fmt::format("</{}> has no opening tag", name.substr(0, 40));
    open_.pop_back();
    closed_ = open_.empty();
    return "";
  }

  const std::string& text_;
  std::size_t at_ = 0;
  int line_ = 1;
  bool closed_ = false;
  std::vector<std::string> open_;
};

}  // namespace

Result<Entries> parse_opencv_xml(const std::string& text, const std::string& name) {
  XmlReader reader(text);
  const std::string error = reader.run();
  if (!error.empty()) return failure(ErrorCode::configuration, error, fmt::format("{}:{}", name, reader.line()));
  return std::move(reader.entries);
}

}  // namespace spartan::internal
