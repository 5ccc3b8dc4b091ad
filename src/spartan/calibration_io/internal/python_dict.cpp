#include "spartan/calibration_io/internal/python_dict.h"

#include <fmt/format.h>

#include <optional>

#include "spartan/core/strict_yaml.h"

namespace spartan::internal {
namespace {

using Value = decltype(PythonDict::Entry::value);

// Limit of nested lists, so that a damaged file cannot exhaust the stack.
constexpr int kMaxDepth = 16;

class Reader {
 public:
  explicit Reader(std::string_view text) : text_(text) {}

  /// An error message; empty on success.
  std::string run() {
    if (!take('{')) return "must begin with {";
    while (!take('}')) {
      const int line = (skip_whitespace(), line_);
      const auto key = read_text();
      if (!key) return "a key in quotes is expected here";
      if (!take(':')) return fmt::format("a colon is missing after '{}'", *key);
      PythonDict::Entry entry{line, {}};
      if (!read_value(entry.value, 0)) {
        return error_.empty() ? fmt::format("the value of '{}' is not well formed", *key)
                              : fmt::format("{}: {}", *key, error_);
      }
      if (!entries.try_emplace(*key, std::move(entry)).second) return fmt::format("'{}' is given twice", *key);
      if (!take(',') && !next_is('}')) return "a comma or } is missing";
    }
    skip_whitespace();
    return at_ == text_.size() ? "" : "has content after the final }";
  }
  int line() const { return line_; }

  std::map<std::string, PythonDict::Entry> entries;

 private:
  void skip_whitespace() {
    for (; at_ < text_.size(); ++at_) {
      const char c = text_[at_];
      if (c == '#') {
        at_ = std::min(text_.find('\n', at_), text_.size());
        if (at_ == text_.size()) return;
      }
      if (text_[at_] == '\n') {
        ++line_;
      } else if (c != ' ' && c != '\t' && c != '\r') {
        return;
      }
    }
  }

  bool next_is(char c) {
    skip_whitespace();
    return at_ < text_.size() && text_[at_] == c;
  }

  bool take(char c) {
    if (!next_is(c)) return false;
    ++at_;
    return true;
  }

  // A string in single or double quotes; a backslash escapes the next character.
  std::optional<std::string> read_text() {
    skip_whitespace();
    if (at_ >= text_.size() || (text_[at_] != '\'' && text_[at_] != '"')) return std::nullopt;
    const char quote = text_[at_++];
    const std::size_t begin = at_;
    for (; at_ < text_.size() && text_[at_] != '\n'; ++at_) {
      if (text_[at_] == '\\') {
        ++at_;
      } else if (text_[at_] == quote) {
        return std::string(text_.substr(begin, at_++ - begin));
      }
    }
    return std::nullopt;
  }

  bool read_value(Value& value, int depth) {
    skip_whitespace();
    if (at_ >= text_.size() || depth > kMaxDepth) return false;
    const char c = text_[at_];
    if (c == '[' || c == '(') return read_list(value, depth);
    if ((c == 'b' || c == 'B') && at_ + 1 < text_.size() && (text_[at_ + 1] == '\'' || text_[at_ + 1] == '"')) {
      ++at_;
      return read_text().has_value();
    }
    if (const auto text = read_text()) {
      value = *text;
      return true;
    }
    const std::size_t end = std::min(text_.find_first_of(" \t\r\n,]})#", at_), text_.size());
    const std::string_view word = text_.substr(at_, end - at_);
    at_ = end;
    if (const auto number = parse_finite_number(word)) {
      value = *number;
      return true;
    }
    error_ = fmt::format("'{}' is not a finite number", word.substr(0, 40));
    return word == "None" || word == "True" || word == "False";
  }

  // Lists of numbers are stored; other lists are skipped.
  bool read_list(Value& value, int depth) {
    const char closing = text_[at_++] == '[' ? ']' : ')';
    std::vector<double> numbers;
    bool only_numbers = true;
    while (!take(closing)) {
      Value entry;
      if (!read_value(entry, depth + 1)) return false;
      const double* number = std::get_if<double>(&entry);
      only_numbers = only_numbers && number != nullptr;
      if (only_numbers) numbers.push_back(*number);
      if (!take(',') && !next_is(closing)) return false;
    }
    if (only_numbers) value = std::move(numbers);
    return true;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
  std::string error_;
};

}  // namespace

Result<PythonDict> PythonDict::parse(std::string_view text, const std::string& name) {
  Reader reader(text);
  const std::string error = reader.run();
  if (!error.empty()) return failure(ErrorCode::configuration, error, fmt::format("{}:{}", name, reader.line()));
  PythonDict dict;
  dict.name_ = name;
  dict.entries_ = std::move(reader.entries);
  return dict;
}

tl::unexpected<Error> PythonDict::error_at(const std::string& key, const std::string& what) const {
  const auto found = entries_.find(key);
  const std::string where = found == entries_.end() ? name_ : fmt::format("{}:{}", name_, found->second.line);
  return failure(ErrorCode::configuration, fmt::format("{}: {}", key, what), where);
}

Result<std::string> PythonDict::text(const std::string& key) const {
  const auto found = entries_.find(key);
  if (found == entries_.end()) return error_at(key, "is missing");
  if (const auto* text = std::get_if<std::string>(&found->second.value)) return *text;
  return error_at(key, "must be a string in quotes");
}

Result<std::vector<double>> PythonDict::numbers(const std::string& key) const {
  const auto found = entries_.find(key);
  if (found == entries_.end()) return error_at(key, "is missing");
  if (const auto* list = std::get_if<std::vector<double>>(&found->second.value)) return *list;
  return error_at(key, "must be a list of numbers");
}

Result<std::vector<double>> PythonDict::numbers(const std::string& key, std::size_t count) const {
  auto list = numbers(key);
  if (list && list->size() != count) {
    return error_at(key, fmt::format("has {} numbers, must have {}", list->size(), count));
  }
  return list;
}

}  // namespace spartan::internal
