#include "spartan/rig/text_matrices.h"

#include <fmt/format.h>

#include <sstream>

#include "spartan/core/files.h"
#include "spartan/rig/yaml_bridge.h"

namespace spartan::rig_detail {

Result<TextMatrices> TextMatrices::read(const std::string& path) {
  auto text = read_file(path);
  if (!text) {
    text.error().code = ErrorCode::configuration;
    return failure(text);
  }
  return parse(*text, path);
}

TextMatrices TextMatrices::parse(const std::string& text, const std::string& name) {
  TextMatrices result;
  result.name_ = name;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    const auto [place, fresh] = result.lines_.try_emplace(line.substr(0, colon), Line{number, line.substr(colon + 1)});
    if (!fresh) place->second.twice = true;
  }
  return result;
}

Result<std::vector<double>> TextMatrices::numbers(const std::string& key, std::size_t count) const {
  const auto found = lines_.find(key);
  if (found == lines_.end())
    return failure(ErrorCode::configuration, fmt::format("the line '{}:' is missing", key), name_);
  const auto fault = [&](const std::string& what) {
    return failure(ErrorCode::configuration, fmt::format("{}: {}", key, what), where(key));
  };
  if (found->second.twice) return fault("given more than once");
  std::vector<double> values;
  std::istringstream words(found->second.text);
  for (std::string word; words >> word;) {
    const auto value = parse_number(word);
    if (!value) return fault(fmt::format("'{}' is not a finite number", word.substr(0, 40)));
    values.push_back(*value);
  }
  if (values.size() != count) return fault(fmt::format("has {} numbers, must have {}", values.size(), count));
  return values;
}

std::string TextMatrices::where(const std::string& key) const {
  const auto found = lines_.find(key);
  return found == lines_.end() ? name_ : fmt::format("{}:{}", name_, found->second.number);
}

}  // namespace spartan::rig_detail
