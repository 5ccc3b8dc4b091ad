#include "spartan/calibration_io/internal/text_matrices.h"

#include <fmt/format.h>

#include <algorithm>

#include "spartan/calibration_io/internal/calibration_text.h"
#include "spartan/core/files.h"
#include "spartan/core/strict_yaml.h"

namespace spartan::internal {

Result<TextMatrices> TextMatrices::read(const std::string& path, char separator) {
  const auto text = read_calibration_text(path);
  if (!text) return failure(text);
  return parse(*text, path, separator);
}

TextMatrices TextMatrices::parse(const std::string& text, const std::string& name, char separator) {
  TextMatrices result;
  result.name_ = name;
  result.separator_ = separator;
  int number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string line = text.substr(begin, end - begin);
    begin = end + 1;
    ++number;
    const std::size_t at = line.find(separator);
    const std::string key = trimmed(line.substr(0, at));
    if (key.starts_with('#')) continue;
    if (at == std::string::npos) {
      if (!key.empty()) result.words_.push_back({number, key});
      continue;
    }
    const auto [entry, inserted] = result.lines_.try_emplace(key, Line{number, line.substr(at + 1)});
    if (!inserted) entry->second.twice = true;
  }
  return result;
}

Result<std::string> TextMatrices::text(const std::string& key) const {
  const auto found = lines_.find(key);
  if (found == lines_.end()) {
    return failure(ErrorCode::configuration, fmt::format("the line '{}{}' is missing", key, separator_), name_);
  }
  if (found->second.twice) return error_at(key, "is given more than once");
  return trimmed(found->second.text);
}

Result<std::vector<double>> TextMatrices::numbers(const std::string& key, std::size_t count) const {
  const auto content = text(key);
  if (!content) return failure(content);
  std::vector<double> values;
  for (const std::string& word : split_words(*content)) {
    if (word.starts_with('#')) break;
    const auto value = parse_finite_number(word);
    if (!value) return error_at(key, fmt::format("'{}' is not a finite number", word.substr(0, 40)));
    values.push_back(*value);
  }
  if (values.size() != count) return error_at(key, fmt::format("has {} numbers, must have {}", values.size(), count));
  return values;
}

Result<Eigen::Vector3d> TextMatrices::vector(const std::string& key) const {
  const auto v = numbers(key, 3);
  if (!v) return failure(v);
  return Eigen::Vector3d((*v)[0], (*v)[1], (*v)[2]);
}

std::string TextMatrices::where(const std::string& key) const {
  const auto found = lines_.find(key);
  return found == lines_.end() ? name_ : fmt::format("{}:{}", name_, found->second.number);
}

tl::unexpected<Error> TextMatrices::error_at(const std::string& key, const std::string& what) const {
  return failure(ErrorCode::configuration, fmt::format("{}: {}", key, what), where(key));
}

}  // namespace spartan::internal
