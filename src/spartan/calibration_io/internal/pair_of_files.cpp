#include "spartan/calibration_io/internal/pair_of_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <filesystem>
#include <optional>
#include <set>
#include <vector>

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

struct Word {
  const char *left, *right;
};
// Words are replaced anywhere in the name; letters and digits only as separate words.
constexpr std::array<Word, 4> kWords{{{"left", "right"}, {"Left", "Right"}, {"LEFT", "RIGHT"}, {"cam0", "cam1"}}};
constexpr std::array<Word, 3> kLetters{{{"l", "r"}, {"L", "R"}, {"0", "1"}}};

bool is_file(const fs::path& path) {
  std::error_code error;
  return fs::is_regular_file(path, error);
}

std::optional<PairOfFiles> split_at_comma(const std::string& path) {
  const std::size_t comma = path.find(',');
  if (comma == std::string::npos || path.find(',', comma + 1) != std::string::npos) return std::nullopt;
  if (comma == 0 || comma + 1 == path.size() || is_file(path)) return std::nullopt;
  return PairOfFiles{path.substr(0, comma), path.substr(comma + 1)};
}

bool is_separate_word(const std::string& name, std::size_t at, std::size_t length) {
  const auto is_word = [&](std::size_t i) { return std::isalnum(static_cast<unsigned char>(name[i])) != 0; };
  return (at == 0 || !is_word(at - 1)) && (at + length >= name.size() || !is_word(at + length));
}

// The existing files whose name results from replacing one occurrence of `word` by `other`.
std::vector<fs::path> partners(const fs::path& file, const std::string& word, const std::string& other, bool separate) {
  std::vector<fs::path> found;
  const std::string name = file.filename().string();
  for (std::size_t at = name.find(word); at != std::string::npos; at = name.find(word, at + 1)) {
    if (separate && !is_separate_word(name, at, word.size())) continue;
    const fs::path candidate = file.parent_path() / std::string(name).replace(at, word.size(), other);
    if (is_file(candidate)) found.push_back(candidate);
  }
  return found;
}

template <class Words>
std::vector<PairOfFiles> pairs_by_replacing(const fs::path& file, const Words& words, bool separate) {
  std::vector<PairOfFiles> found;
  for (const Word& word : words) {
    for (const fs::path& right : partners(file, word.left, word.right, separate)) {
      found.push_back({file.string(), right.string()});
    }
    for (const fs::path& left : partners(file, word.right, word.left, separate)) {
      found.push_back({left.string(), file.string()});
    }
  }
  return found;
}

}  // namespace

Result<PairOfFiles> find_pair_of_files(const std::string& path) {
  if (const auto both = split_at_comma(path)) return *both;
  std::vector<PairOfFiles> found = pairs_by_replacing(path, kWords, false);
  if (found.empty()) found = pairs_by_replacing(path, kLetters, true);
  if (found.size() == 1) return found.front();
  const std::string hint = "name both files: LEFT,RIGHT";
  if (found.empty()) {
    return failure(ErrorCode::configuration, "the file of the other camera is not found", path, hint);
  }
  std::vector<std::string> names;
  names.reserve(found.size());
  for (const PairOfFiles& pair : found) names.push_back(pair.left == path ? pair.right : pair.left);
  return failure(ErrorCode::configuration,
                 fmt::format("{} could each be the file of the other camera", fmt::join(names, " and ")), path, hint);
}

PairOfFiles names_of_pair(const std::string& path) {
  if (const auto both = split_at_comma(path)) return *both;
  const fs::path file(path);
  const auto with = [&](const char* side) {
    return (file.parent_path() / (file.stem().string() + "_" + side + file.extension().string())).string();
  };
  return {with("left"), with("right")};
}

}  // namespace spartan::internal
