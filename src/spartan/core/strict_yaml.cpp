#include "spartan/core/strict_yaml.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <sstream>

namespace spartan {

struct YamlNode::Content {
  Kind kind = Kind::null;
  int line = 0;
  int depth = 1;  // of nested lists and maps
  std::string scalar;
  std::vector<YamlNode> items;
  std::vector<YamlEntry> entries;
};

YamlNode YamlNode::text(std::string scalar) {
  Content content;
  content.kind = Kind::scalar;
  content.scalar = std::move(scalar);
  YamlNode node;
  node.content_ = std::make_shared<const Content>(std::move(content));
  return node;
}

YamlNode YamlNode::map_of(std::vector<YamlEntry> entries) {
  Content map;
  map.kind = Kind::map;
  map.entries = std::move(entries);
  YamlNode node;
  node.content_ = std::make_shared<const Content>(std::move(map));
  return node;
}

YamlNode::Kind YamlNode::kind() const {
  return content_ ? content_->kind : Kind::null;
}
const std::string& YamlNode::scalar() const {
  static const std::string none;
  return content_ ? content_->scalar : none;
}
const std::vector<YamlNode>& YamlNode::items() const {
  static const std::vector<YamlNode> none;
  return content_ ? content_->items : none;
}
const std::vector<YamlEntry>& YamlNode::entries() const {
  static const std::vector<YamlEntry> none;
  return content_ ? content_->entries : none;
}
int YamlNode::line() const {
  return content_ ? content_->line : 0;
}

// Builds the tree from the events of the parser. An alias shares the node of its anchor; it can only refer to a node
// that is complete, so there are no cycles. The depth is limited because nodes are destroyed recursively; the parser
// has the same limit, but aliases can nest deeper.
class YamlBuilder : public YAML::EventHandler {
 public:
  YamlNode take_root() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    add(make_node(make_content(YamlNode::Kind::null, mark)), anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end()) throw YAML::ParserException(mark, "an alias refers to the value that contains it");
    if (static_cast<std::size_t>(found->second.content_->depth) + open_.size() > kMaxDepth)
      throw YAML::ParserException(mark, "aliases are nested too deeply");
    add(found->second, 0);
  }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor, const std::string& value) override {
    YamlNode::Content scalar = make_content(YamlNode::Kind::scalar, mark);
    scalar.scalar = value;
    add(make_node(std::move(scalar)), anchor);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open_.push_back({make_content(YamlNode::Kind::list, mark), anchor, std::nullopt});
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open_.push_back({make_content(YamlNode::Kind::map, mark), anchor, std::nullopt});
  }
  void OnMapEnd() override { close(); }

 private:
  static constexpr std::size_t kMaxDepth = 500;

  struct Open {
    YamlNode::Content content;
    YAML::anchor_t anchor;
    std::optional<YamlNode> key;  // of a map, until its value follows
  };

  static YamlNode::Content make_content(YamlNode::Kind kind, const YAML::Mark& mark) {
    YamlNode::Content result;
    result.kind = kind;
    result.line = mark.is_null() ? 0 : mark.line + 1;
    return result;
  }
  static YamlNode make_node(YamlNode::Content content) {
    YamlNode node;
    node.content_ = std::make_shared<const YamlNode::Content>(std::move(content));
    return node;
  }

  void add(const YamlNode& node, YAML::anchor_t anchor) {
    if (anchor != 0) anchors_[anchor] = node;
    if (open_.empty()) {
      root_ = node;
      return;
    }
    Open& parent = open_.back();
    parent.content.depth = std::max(parent.content.depth, node.content_->depth + 1);
    if (parent.content.kind == YamlNode::Kind::list) {
      parent.content.items.push_back(node);
    } else if (!parent.key) {
      parent.key = node;
    } else {
      parent.content.entries.push_back({*parent.key, node});
      parent.key.reset();
    }
  }

  void close() {
    Open last = std::move(open_.back());
    open_.pop_back();
    add(make_node(std::move(last.content)), last.anchor);
  }

  YamlNode root_;
  std::vector<Open> open_;  // the lists and maps around the current event, innermost last
  std::map<YAML::anchor_t, YamlNode> anchors_;
};

namespace {

constexpr std::ptrdiff_t kMaxValues = 100000;  // as documented at parse_yaml()
constexpr std::size_t kMaxReported = 50;       // errors of one file

// An upper bound of the number of values: counts the characters that can start one.
std::ptrdiff_t max_value_count(const std::string& text) {
  return std::count_if(text.begin(), text.end(), [](char c) { return c == ',' || c == '\n' || c == '[' || c == '{'; });
}

// The length in bytes of the UTF-8 character at `at`; 0 if there is no valid one (RFC 3629).
std::size_t character_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint32_t>(static_cast<unsigned char>(text[i])); };
  const std::uint32_t lead = byte(at);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC0 || lead > 0xF4 || at + length > text.size()) return 0;
  std::uint32_t code = lead & (0xFFU >> (length + 1));
  for (std::size_t k = 1; k < length; ++k) {
    if ((byte(at + k) & 0xC0) != 0x80) return 0;
    code = code << 6 | (byte(at + k) & 0x3F);
  }
  constexpr std::uint32_t kMinCode[] = {0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800 && code < 0xE000;
  return code < kMinCode[length - 2] || code > 0x10FFFF || surrogate ? 0 : length;
}

// The offset of the first byte that is not UTF-8; the size of the text if there is none.
std::size_t first_invalid_utf8(std::string_view text) {
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t length = character_length(text, at);
    if (length == 0) return at;
    at += length;
  }
  return at;
}

bool contains_key(const std::string& group, const std::string& key) {
  return group.empty() || key == group ||
         (key.size() > group.size() && key.starts_with(group) && key[group.size()] == '.');
}

bool is_not_finite(std::string_view text) {
  if (!text.empty() && (text.front() == '+' || text.front() == '-')) text.remove_prefix(1);
  if (!text.empty() && text.front() == '.') text.remove_prefix(1);
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  return lower == "nan" || lower == "inf" || lower == "infinity";
}

std::string number_error(std::string_view text, std::string_view kind) {
  if (is_not_finite(text)) return fmt::format("is {}, must be a finite number", text);
  return fmt::format("'{}' is not a {}", text.substr(0, 40), kind);
}

}  // namespace

Result<YamlNode> parse_yaml(const std::string& text, const std::string& name) {
  if (const std::size_t at = first_invalid_utf8(text); at < text.size()) {
    const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1;
    return failure(ErrorCode::configuration, "not valid UTF-8", fmt::format("{}:{}", name, line));
  }
  if (max_value_count(text) > kMaxValues) {
    return failure(ErrorCode::configuration, fmt::format("holds more than {} values", kMaxValues), name);
  }
  try {
    // The parser accepts a quoted text without its closing quote at the end of the input, but not before an end marker.
    std::istringstream stream(text + (text.ends_with('\n') ? "...\n" : "\n...\n"));
    YAML::Parser parser(stream);
    YamlBuilder first, second;
    parser.HandleNextDocument(first);
    // Once only: the parser may hand out empty documents without end.
    if (parser.HandleNextDocument(second) && !second.take_root().is_null())
      return failure(ErrorCode::configuration, "holds more than one document", name);
    return first.take_root();
  } catch (const YAML::Exception& e) {
    const std::string where = e.mark.is_null() ? name : fmt::format("{}:{}", name, e.mark.line + 1);
    return failure(ErrorCode::configuration, "not valid YAML: " + e.msg, where);
  }
}

std::optional<double> parse_finite_number(std::string_view text) {
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::string yaml_quoted(const std::string& text) {
  YAML::Emitter emitter;
  emitter << YAML::DoubleQuoted << text;
  return emitter.c_str();
}

void YamlErrors::set_line(const std::string& key, int line) {
  if (line > 0) lines_.emplace(key, line);
}

int YamlErrors::line_of(std::string key) const {
  while (true) {
    if (const auto found = lines_.find(key); found != lines_.end()) return found->second;
    const std::size_t dot = key.rfind('.');
    if (dot == std::string::npos) return 1;
    key.resize(dot);
  }
}

std::string YamlErrors::location(const std::string& key) const {
  const std::string where = has_lines_ ? fmt::format("{}:{}", name_, line_of(key)) : name_;
  return key.empty() ? where : fmt::format("{}: {}", where, key);
}

void YamlErrors::add(const std::string& key, const std::string& what) {
  keys_.insert(key);
  errors_.push_back({has_lines_ ? line_of(key) : 0, fmt::format("{}: {}", location(key), what)});
}

bool YamlErrors::has_error_near(const std::string& key) const {
  return std::any_of(keys_.begin(), keys_.end(),
                     [&](const std::string& other) { return contains_key(other, key) || contains_key(key, other); });
}

Status YamlErrors::status(const std::string& hint) const {
  if (errors_.empty()) return {};
  std::vector<Line> sorted = errors_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Line& a, const Line& b) { return a.number < b.number; });
  std::string text;
  const std::size_t reported = std::min(sorted.size(), kMaxReported);
  for (std::size_t i = 0; i < reported; ++i) text += (text.empty() ? "" : "\n") + sorted[i].text;
  if (reported < sorted.size()) text += fmt::format("\n{}: and {} more errors", name_, sorted.size() - reported);
  return failure(ErrorCode::configuration, text, {}, hint);
}

YamlMap::YamlMap(const YamlNode& node, std::string key, YamlErrors& errors) : key_(std::move(key)), errors_(errors) {
  if (!node.is_map()) {
    errors_.add(key_, "must be a group of `key: value` lines");
    return;
  }
  std::set<std::string> seen;
  for (const YamlEntry& entry : node.entries()) {
    if (!entry.key.is_scalar()) {
      errors_.set_line(key_, entry.key.line());
      errors_.add(key_, "a key must be a scalar; quote it if it is a YAML keyword");
      continue;
    }
    const std::string& name = entry.key.scalar();
    errors_.set_line(path(name), entry.key.line());
    if (seen.insert(name).second) {
      entries_.emplace_back(name, entry.value);
    } else {
      add_error(name, errors_.has_lines() ? fmt::format("is given twice, again in line {}", entry.key.line())
                                          : std::string("is given twice"));
    }
  }
}

std::string YamlMap::path(std::string_view key) const {
  return key_.empty() ? std::string(key) : fmt::format("{}.{}", key_, key);
}

std::optional<YamlNode> YamlMap::optional_node(std::string_view key) {
  known_.emplace(key);
  for (const auto& [name, value] : entries_) {
    if (name == key) return value;
  }
  return std::nullopt;
}

bool YamlMap::has(std::string_view key) {
  return optional_node(key).has_value();
}

std::optional<YamlNode> YamlMap::node(std::string_view key) {
  auto found = optional_node(key);
  if (!found) add_error(key, "is missing");
  return found;
}

std::optional<std::string> YamlMap::text(std::string_view key) {
  const auto found = node(key);
  if (!found) return std::nullopt;
  if (found->is_scalar()) return found->scalar();
  add_error(key, "must be text");
  return std::nullopt;
}

std::optional<std::string> YamlMap::choice(std::string_view key, const std::vector<std::string>& choices) {
  auto chosen = text(key);
  if (!chosen || std::find(choices.begin(), choices.end(), *chosen) != choices.end()) return chosen;
  add_error(key, fmt::format("is '{}', must be one of: {}", *chosen, fmt::join(choices, ", ")));
  return std::nullopt;
}

// The spellings of the core schema of YAML 1.2; "yes", "on" and the like of YAML 1.1 are text.
std::optional<bool> YamlMap::boolean(std::string_view key) {
  const auto found = node(key);
  if (!found) return std::nullopt;
  const std::string& word = found->scalar();
  if (word == "true" || word == "True" || word == "TRUE") return true;
  if (word == "false" || word == "False" || word == "FALSE") return false;
  add_error(key, "must be true or false");
  return std::nullopt;
}

std::optional<double> YamlMap::number(std::string_view key) {
  const auto found = node(key);
  if (!found) return std::nullopt;
  const auto value = parse_finite_number(found->scalar());
  if (!value) add_error(key, found->is_scalar() ? number_error(found->scalar(), "number") : "must be a number");
  return value;
}

std::optional<int> YamlMap::integer(std::string_view key) {
  const auto found = node(key);
  if (!found) return std::nullopt;
  const auto value = parse_finite_number(found->scalar());
  if (!value) {
    add_error(key, found->is_scalar() ? number_error(found->scalar(), "whole number") : "must be a whole number");
    return std::nullopt;
  }
  using Limits = std::numeric_limits<int>;
  if (*value != std::floor(*value) || *value < Limits::min() || *value > Limits::max()) {
    add_error(key,
              fmt::format("is {}, must be a whole number between {} and {}", *value, Limits::min(), Limits::max()));
    return std::nullopt;
  }
  return static_cast<int>(*value);
}

std::optional<std::vector<double>> YamlMap::numbers(std::string_view key, const std::vector<int>& counts) {
  const auto found = node(key);
  if (!found) return std::nullopt;
  const std::string wanted = counts.empty() ? std::string("a list of numbers")
                                            : fmt::format("a list of {} numbers", fmt::join(counts, " or "));
  if (!found->is_list()) {
    add_error(key, "must be " + wanted);
    return std::nullopt;
  }
  const std::vector<YamlNode>& items = found->items();
  if (!counts.empty() && std::find(counts.begin(), counts.end(), static_cast<int>(items.size())) == counts.end()) {
    add_error(key, fmt::format("has {} entries, must be {}", items.size(), wanted));
    return std::nullopt;
  }
  std::vector<double> values;
  values.reserve(items.size());
  for (const YamlNode& item : items) {
    const auto value = parse_finite_number(item.scalar());
    if (!value) {
      add_error(key, item.is_scalar() ? number_error(item.scalar(), "number") : "must hold numbers only");
      return std::nullopt;
    }
    values.push_back(*value);
  }
  return values;
}

bool YamlMap::rename(std::string_view old_key, std::string_view key) {
  const auto find = [&](std::string_view name) {
    return std::find_if(entries_.begin(), entries_.end(), [&](const auto& entry) { return entry.first == name; });
  };
  const auto former = find(old_key);
  if (former == entries_.end()) return false;
  if (find(key) != entries_.end()) {
    add_error(old_key, fmt::format("is the former name of {}, which is given too", key));
    entries_.erase(former);
    return false;
  }
  errors_.set_line(path(key), errors_.line_of(path(old_key)));
  former->first = key;
  return true;
}

void YamlMap::reject_unknown_keys() {
  for (const auto& [name, value] : entries_) {
    if (!known_.contains(name)) {
      const std::string meant = closest_name(name, {known_.begin(), known_.end()});
      add_error(name, fmt::format("unknown key; {}known keys: {}", meant.empty() ? "" : "did you mean " + meant + "? ",
                                  fmt::join(known_, ", ")));
    }
  }
}

}  // namespace spartan
