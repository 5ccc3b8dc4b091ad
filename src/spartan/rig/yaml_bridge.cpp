#include "spartan/rig/yaml_bridge.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace spartan::rig_detail {
namespace {

// A parsed value needs hundreds of times its size in the file; larger files are rejected before parsing.
constexpr std::ptrdiff_t kMaxValues = 100000;

// Upper bound of the number of values: counts the characters that start one.
std::ptrdiff_t max_value_count(const std::string& text) {
  return std::count_if(text.begin(), text.end(), [](char c) { return c == ',' || c == '\n' || c == '[' || c == '{'; });
}

constexpr std::size_t kMaxReported = 50;  // errors of one file

bool starts_with_key(const std::string& key, const std::string& group) {
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

std::string number_fault(std::string_view text) {
  if (is_not_finite(text)) return fmt::format("is {}, must be a finite number", text);
  return fmt::format("'{}' is not a number", text.substr(0, 40));
}

// Length in bytes of the UTF-8 character at `at`; 0 where there is no valid one (RFC 3629).
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

// Offset of the first byte that is not UTF-8; the size of the text if there is none.
std::size_t first_invalid_utf8(std::string_view text) {
  std::size_t at = 0;
  while (at < text.size()) {
    const std::size_t length = character_length(text, at);
    if (length == 0) return at;
    at += length;
  }
  return at;
}

}  // namespace

void YamlFaults::saw(const std::string& key, const YAML::Node& node) {
  const YAML::Mark mark = node.Mark();
  if (!mark.is_null()) lines_.emplace(key, mark.line + 1);
}

int YamlFaults::line_of(std::string key) const {
  while (true) {
    if (const auto found = lines_.find(key); found != lines_.end()) return found->second;
    const std::size_t dot = key.rfind('.');
    if (dot == std::string::npos) return 1;
    key.resize(dot);
  }
}

void YamlFaults::add(const std::string& key, const std::string& what) {
  const int line = line_of(key);
  keys_.insert(key);
  faults_.push_back({line, fmt::format("{}:{}: {}{}{}", name_, line, key, key.empty() ? "" : ": ", what)});
}

bool YamlFaults::touches(const std::string& key) const {
  return std::any_of(keys_.begin(), keys_.end(), [&](const std::string& faulty) {
    return starts_with_key(key, faulty) || starts_with_key(faulty, key);
  });
}

Status YamlFaults::status() const {
  if (faults_.empty()) return {};
  std::vector<Line> sorted = faults_;
  std::stable_sort(sorted.begin(), sorted.end(), [](const Line& a, const Line& b) { return a.number < b.number; });
  std::string text;
  const std::size_t reported = std::min(sorted.size(), kMaxReported);
  for (std::size_t i = 0; i < reported; ++i) text += (text.empty() ? "" : "\n") + sorted[i].text;
  if (reported < sorted.size()) text += fmt::format("\n{}: and {} more errors", name_, sorted.size() - reported);
  return failure(ErrorCode::configuration, text);
}

Result<YAML::Node> load_yaml(const std::string& text, const std::string& name) {
  if (const std::size_t at = first_invalid_utf8(text); at < text.size()) {
    const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1;
    return failure(ErrorCode::configuration, "not valid UTF-8", fmt::format("{}:{}", name, line));
  }
  if (max_value_count(text) > kMaxValues) {
    return failure(ErrorCode::configuration,
                   fmt::format("holds more than {} values, too many for a calibration", kMaxValues), name);
  }
  try {
    return YAML::Load(text);
  } catch (const YAML::Exception& e) {
    const std::string where = e.mark.is_null() ? name : fmt::format("{}:{}", name, e.mark.line + 1);
    return failure(ErrorCode::configuration, "not valid YAML: " + e.msg, where);
  }
}

std::optional<double> parse_number(std::string_view text) {
  if (text.size() > 1 && text.front() == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

YamlMap::YamlMap(const YAML::Node& node, std::string key, YamlFaults& faults) : key_(std::move(key)), faults_(faults) {
  if (!node.IsMap()) {
    faults_.add(key_, "must be a group of `key: value` lines");
    return;
  }
  std::set<std::string> seen;
  for (const auto& entry : node) {
    faults_.saw(entry.first.IsScalar() ? path(entry.first.Scalar()) : key_, entry.first);
    if (!entry.first.IsScalar()) {
      faults_.add(key_, "a key must be a scalar");
    } else if (!seen.insert(entry.first.Scalar()).second) {
      faults_.add(path(entry.first.Scalar()),
                  fmt::format("given a second time in line {}", entry.first.Mark().line + 1));
    } else {
      entries_.emplace_back(entry.first.Scalar(), entry.second);
    }
  }
}

std::string YamlMap::path(std::string_view key) const {
  return key_.empty() ? std::string(key) : fmt::format("{}.{}", key_, key);
}

bool YamlMap::has(std::string_view key) const {
  return std::any_of(entries_.begin(), entries_.end(), [&](const auto& entry) { return entry.first == key; });
}

std::optional<YAML::Node> YamlMap::optional_node(std::string_view key) {
  known_.emplace(key);
  for (const auto& [name, node] : entries_) {
    if (name == key) return node;
  }
  return std::nullopt;
}

std::optional<YAML::Node> YamlMap::node(std::string_view key) {
  auto found = optional_node(key);
  if (!found) fault(key, "is missing");
  return found;
}

std::optional<std::string> YamlMap::text(std::string_view key) {
  const auto found = node(key);
  if (!found) return std::nullopt;
  if (found->IsScalar()) return found->Scalar();
  fault(key, "must be text");
  return std::nullopt;
}

std::optional<std::string> YamlMap::choice(std::string_view key, const std::vector<std::string>& choices) {
  auto chosen = text(key);
  if (!chosen || std::find(choices.begin(), choices.end(), *chosen) != choices.end()) return chosen;
  fault(key, fmt::format("is '{}', must be one of: {}", *chosen, fmt::join(choices, ", ")));
  return std::nullopt;
}

std::optional<bool> YamlMap::boolean(std::string_view key) {
  const auto found = node(key);
  if (!found) return std::nullopt;
  if (found->IsScalar() && found->Scalar() == "true") return true;
  if (found->IsScalar() && found->Scalar() == "false") return false;
  fault(key, "must be true or false");
  return std::nullopt;
}

std::optional<double> YamlMap::number(std::string_view key) {
  const auto found = node(key);
  if (!found) return std::nullopt;
  if (!found->IsScalar()) {
    fault(key, "must be a number");
    return std::nullopt;
  }
  const auto value = parse_number(found->Scalar());
  if (!value) fault(key, number_fault(found->Scalar()));
  return value;
}

std::optional<int> YamlMap::integer(std::string_view key) {
  const auto value = number(key);
  if (!value) return std::nullopt;
  if (*value != std::floor(*value) || std::abs(*value) > 1e9) {
    fault(key, fmt::format("is {}, must be a whole number", *value));
    return std::nullopt;
  }
  return static_cast<int>(*value);
}

std::optional<std::vector<double>> YamlMap::numbers(std::string_view key, const std::vector<int>& counts) {
  const auto found = node(key);
  if (!found) return std::nullopt;
  const std::string wanted = fmt::format("{} numbers", fmt::join(counts, " or "));
  if (!found->IsSequence()) {
    fault(key, fmt::format("must be a list of {}", wanted));
    return std::nullopt;
  }
  if (std::find(counts.begin(), counts.end(), static_cast<int>(found->size())) == counts.end()) {
    fault(key, fmt::format("has {} entries, must be a list of {}", found->size(), wanted));
    return std::nullopt;
  }
  std::vector<double> values;
  for (const YAML::Node& entry : *found) {
    const auto value = entry.IsScalar() ? parse_number(entry.Scalar()) : std::nullopt;
    if (!value) {
      fault(key, entry.IsScalar() ? number_fault(entry.Scalar()) : "must hold numbers only");
      return std::nullopt;
    }
    values.push_back(*value);
  }
  return values;
}

void YamlMap::refuse_unknown_keys() {
  for (const auto& [name, node] : entries_) {
    if (!known_.contains(name)) fault(name, fmt::format("unknown key; known here: {}", fmt::join(known_, ", ")));
  }
}

}  // namespace spartan::rig_detail
