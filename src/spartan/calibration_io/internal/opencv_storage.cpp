#include "spartan/calibration_io/internal/opencv_storage.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/core/files.h"
#include "spartan/core/strict_yaml.h"

namespace spartan::internal {
namespace {

using Entry = OpencvStorage::Entry;

std::optional<int> whole(const std::string& word) {
  const auto value = parse_finite_number(word);
  if (!value || *value != static_cast<double>(static_cast<long>(std::clamp(*value, -1e9, 1e9)))) return std::nullopt;
  return static_cast<int>(*value);
}

std::vector<std::string> words_of(const YamlNode& node) {
  std::vector<std::string> words;
  if (node.is_scalar()) words.push_back(node.scalar());
  if (!node.is_list()) return words;
  words.reserve(node.items().size());
  for (const YamlNode& entry : node.items()) words.push_back(entry.is_scalar() ? entry.scalar() : "[");
  return words;
}

// A matrix, a list or a scalar; other mappings become an empty entry.
Entry entry_of(const YamlNode& node, int line) {
  Entry entry;
  entry.line = line;
  if (!node.is_map()) {
    entry.words = words_of(node);
    return entry;
  }
  for (const auto& [key, value] : node.entries()) {
    if (key.scalar() == "rows") entry.rows = value.scalar();
    if (key.scalar() == "cols") entry.columns = value.scalar();
    if (key.scalar() == "data") entry.words = words_of(value);
  }
  return entry;
}

Result<std::map<std::string, Entry>> parse_opencv_yaml(std::string text, const std::string& name) {
  // OpenCV's "%YAML:1.0" is not a valid YAML directive; as a comment it keeps the line numbers.
  if (text.starts_with("%YAML")) text.front() = '#';
  const auto loaded = parse_yaml(text, name);
  if (!loaded) return failure(loaded);
  if (!loaded->is_map()) return failure(ErrorCode::configuration, "is not an OpenCV file: it has no keys", name);
  std::map<std::string, Entry> entries;
  for (const auto& [key, value] : loaded->entries()) {
    if (!key.is_scalar()) continue;
    if (!entries.try_emplace(key.scalar(), entry_of(value, key.line())).second) {
      return failure(ErrorCode::configuration, key.scalar() + ": is given twice",
                     fmt::format("{}:{}", name, key.line()));
    }
  }
  return entries;
}

}  // namespace

Result<OpencvStorage> OpencvStorage::read(const std::string& path) {
  const auto text = read_calibration_text(path);
  if (!text) return failure(text);
  const std::size_t first = text->find_first_not_of(" \t\r\n");
  const bool xml = first != std::string::npos && (*text)[first] == '<';
  auto entries = xml ? parse_opencv_xml(*text, path) : parse_opencv_yaml(*text, path);
  if (!entries) return failure(std::move(entries));
  OpencvStorage storage;
  storage.name_ = path;
  storage.entries_ = std::move(*entries);
  return storage;
}

tl::unexpected<Error> OpencvStorage::error_at(const std::string& key, const std::string& what) const {
  const auto found = entries_.find(key);
  const std::string where = found == entries_.end() ? name_ : fmt::format("{}:{}", name_, found->second.line);
  return failure(ErrorCode::configuration, fmt::format("{}: {}", key, what), where);
}

Result<std::vector<double>> OpencvStorage::matrix(const std::string& key, const std::vector<int>& counts) const {
  const auto found = entries_.find(key);
  if (found == entries_.end()) return error_at(key, "is missing");
  const Entry& entry = found->second;
  const auto rows = whole(entry.rows), columns = whole(entry.columns);
  if (!rows || !columns || *rows < 1 || *columns < 1) return error_at(key, "is not a matrix");
  const auto total = std::ssize(entry.words);
  if (std::int64_t{*rows} * *columns != total) return error_at(key, "does not have rows × cols numbers");
  if (std::find(counts.begin(), counts.end(), total) == counts.end()) {
    return error_at(key, fmt::format("has {} numbers, must have {}", total, fmt::join(counts, " or ")));
  }
  std::vector<double> values;
  values.reserve(entry.words.size());
  for (const std::string& word : entry.words) {
    const auto value = parse_finite_number(word);
    if (!value) return error_at(key, fmt::format("'{}' is not a finite number", word.substr(0, 40)));
    values.push_back(*value);
  }
  return values;
}

std::optional<int> OpencvStorage::integer(const std::string& key) const {
  const auto found = entries_.find(key);
  if (found == entries_.end() || found->second.words.size() != 1) return std::nullopt;
  return whole(found->second.words.front());
}

std::optional<ImageSize> OpencvStorage::size(const std::string& key) const {
  const auto found = entries_.find(key);
  if (found == entries_.end() || found->second.words.size() != 2) return std::nullopt;
  const auto width = whole(found->second.words[0]), height = whole(found->second.words[1]);
  return width && height ? std::optional(ImageSize{*width, *height}) : std::nullopt;
}

std::string OpencvStorage::text(const std::string& key) const {
  const auto found = entries_.find(key);
  return found == entries_.end() || found->second.words.empty() ? "" : found->second.words.front();
}

}  // namespace spartan::internal
