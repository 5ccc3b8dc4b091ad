#include "spartan/rig/formats/python_dict.h"

#include <fmt/format.h>

#include <optional>

#include "spartan/rig/yaml_bridge.h"

namespace spartan::rig_detail {
namespace {

using Value = decltype(PythonDict::Entry::value);

// Deeper lists than this are no calibration, and would take the stack.
constexpr int kDeepest = 16;

class Reader {
 public:
  explicit Reader(std::string_view text) : text_(text) {}

  /// Empty where all went well.
  std::string run() {
    if (!take('{')) return "must begin with {";
    while (!take('}')) {
      const int line = (skip_blanks(), line_);
      const auto key = read_text();
      if (!key) return "must have a key in quotes here";
      if (!take(':')) return fmt::format("misses a colon behind '{}'", *key);
      PythonDict::Entry entry{line, {}};
      if (!read_value(entry.value, 0)) {
        return fault_.empty() ? fmt::format("the value of '{}' is not well formed", *key)
                              : fmt::format("{}: {}", *key, fault_);
      }
      if (!entries.try_emplace(*key, std::move(entry)).second) return fmt::format("'{}' is given a second time", *key);
      if (!take(',') && !next_is('}')) return "misses a comma or }";
    }
    skip_blanks();
    return at_ == text_.size() ? "" : "goes on behind its }";
  }
  int line() const { return line_; }

  std::map<std::string, PythonDict::Entry> entries;

 private:
  void skip_blanks() {
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
    skip_blanks();
    return at_ < text_.size() && text_[at_] == c;
  }

  bool take(char c) {
    if (!next_is(c)) return false;
    ++at_;
    return true;
  }

  // In quotes of either kind; a backslash keeps the next character from ending it.
  std::optional<std::string> read_text() {
    skip_blanks();
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
    skip_blanks();
    if (at_ >= text_.size() || depth > kDeepest) return false;
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
    if (const auto number = parse_number(word)) {
      value = *number;
      return true;
    }
    fault_ = fmt::format("'{}' is not a finite number", word.substr(0, 40));
    return word == "None" || word == "True" || word == "False";
  }

  // Numbers stay; a list that holds anything else is passed over.
  bool read_list(Value& value, int depth) {
    const char closing = text_[at_++] == '[' ? ']' : ')';
    std::vector<double> numbers;
    bool plain = true;
    while (!take(closing)) {
      Value entry;
      if (!read_value(entry, depth + 1)) return false;
      const double* number = std::get_if<double>(&entry);
      plain = plain && number != nullptr;
      if (plain) numbers.push_back(*number);
      if (!take(',') && !next_is(closing)) return false;
    }
    if (plain) value = std::move(numbers);
    return true;
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
  std::string fault_;
};

}  // namespace

Result<PythonDict> PythonDict::parse(std::string_view text, const std::string& name) {
  Reader reader(text);
  const std::string fault = reader.run();
  if (!fault.empty()) return failure(ErrorCode::configuration, fault, fmt::format("{}:{}", name, reader.line()));
  PythonDict dict;
  dict.name_ = name;
  dict.entries_ = std::move(reader.entries);
  return dict;
}

tl::unexpected<Error> PythonDict::fault(const std::string& key, const std::string& what) const {
  const auto found = entries_.find(key);
  const std::string where = found == entries_.end() ? name_ : fmt::format("{}:{}", name_, found->second.line);
  return failure(ErrorCode::configuration, fmt::format("{}: {}", key, what), where);
}

Result<std::string> PythonDict::text(const std::string& key) const {
  const auto found = entries_.find(key);
  if (found == entries_.end()) return fault(key, "is missing");
  if (const auto* text = std::get_if<std::string>(&found->second.value)) return *text;
  return fault(key, "must be text in quotes");
}

Result<std::vector<double>> PythonDict::numbers(const std::string& key) const {
  const auto found = entries_.find(key);
  if (found == entries_.end()) return fault(key, "is missing");
  if (const auto* list = std::get_if<std::vector<double>>(&found->second.value)) return *list;
  return fault(key, "must be a list of numbers");
}

Result<std::vector<double>> PythonDict::numbers(const std::string& key, std::size_t count) const {
  auto list = numbers(key);
  if (list && list->size() != count) {
    return fault(key, fmt::format("has {} numbers, must have {}", list->size(), count));
  }
  return list;
}

}  // namespace spartan::rig_detail
