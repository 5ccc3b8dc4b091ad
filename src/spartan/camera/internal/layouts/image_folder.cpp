#include "spartan/camera/internal/layouts/image_folder.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <limits>
#include <map>
#include <string_view>

#include "spartan/camera/internal/table.h"
#include "spartan/core/files.h"
#include "spartan/image_io/image_io.h"

namespace spartan::internal {
namespace {

namespace fs = std::filesystem;

// Larger file numbers (such as time stamps) are not frame numbers; empirical.
constexpr std::int64_t kLargestNumber = 100'000'000;
constexpr std::size_t kSizeProbes = 16;  // image headers read to find the common size

constexpr std::array<std::string_view, 5> kExtensions{".png", ".jpg", ".jpeg", ".pgm", ".ppm"};

using Stems = std::map<std::string, std::string>;  // as list_images()

// The number of each stem; nothing where names are not frame numbers: they hold a letter, or the numbers span far more
// than the number of files.
std::optional<std::map<std::string, std::int64_t>> numbers_of(const Stems& left, const Stems& right,
                                                              std::size_t announced) {
  std::map<std::string, std::int64_t> numbers;
  std::int64_t low = std::numeric_limits<std::int64_t>::max(), high = 0;
  for (const Stems* stems : {&left, &right}) {
    for (const auto& [stem, path] : *stems) {
      const auto number = parse_number<std::int64_t>(stem);
      if (!number || *number < 0 || *number > kLargestNumber) return std::nullopt;
      numbers[stem] = *number;
      low = std::min(low, *number);
      high = std::max(high, *number);
    }
  }
  // Missing files are allowed: numbers may span ten times the count of frames or files, plus 100; empirical.
  const auto most = static_cast<std::int64_t>(10 * std::max(announced, left.size() + right.size()) + 100);
  if (!numbers.empty() && high - low > most) return std::nullopt;
  return numbers;
}

// The rank of each stem among the sorted stems of both folders.
std::map<std::string, std::int64_t> ranks_of(const Stems& left, const Stems& right) {
  std::map<std::string, std::int64_t> ranks;
  for (const Stems* stems : {&left, &right}) {
    for (const auto& [stem, path] : *stems) ranks[stem] = 0;
  }
  std::int64_t rank = 0;
  for (auto& [stem, number] : ranks) number = rank++;
  return ranks;
}

}  // namespace

Result<std::map<std::string, std::string>> list_images(const std::string& folder, const std::string& pattern) {
  std::map<std::string, std::string> images;
  const auto names = list_folder(folder);
  if (!names && names.error().code == ErrorCode::input) return images;
  if (!names) return failure(names);
  for (const std::string_view wanted : kExtensions) {
    for (const std::string& name : *names) {
      const fs::path path(name);
      std::string extension = path.extension().string();
      std::transform(extension.begin(), extension.end(), extension.begin(),
                     [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
      if (extension == wanted && ::fnmatch(pattern.c_str(), name.c_str(), 0) == 0)
        images.emplace(path.stem().string(), (folder / path).string());
    }
  }
  return images;
}

Result<NumberedImages> number_images(const std::string& left_folder, const std::string& right_folder,
                                     std::optional<std::size_t> announced) {
  NumberedImages images;
  const auto left_images = list_images(left_folder), right_images = list_images(right_folder);
  if (!left_images) return failure(left_images);
  if (!right_images) return failure(right_images);
  const Stems &left = *left_images, &right = *right_images;
  auto numbers = numbers_of(left, right, announced.value_or(0));
  if (!numbers) {
    images.remarks.emplace_back("the image names are not frame numbers; images are used in the order of their names");
    numbers = ranks_of(left, right);
  }
  std::int64_t low = std::numeric_limits<std::int64_t>::max(), high = -1;
  for (const auto& [stem, number] : *numbers) {
    low = std::min(low, number);
    high = std::max(high, number);
  }
  const std::int64_t span = high < 0 ? 0 : high - low + 1;
  const auto count = announced ? static_cast<std::int64_t>(*announced) : span;
  if (high >= 0 && (!announced || low >= count)) images.first_number = low;
  if (images.first_number > 0) {
    images.remarks.push_back(fmt::format("the image numbers start at {}, which is taken as the first frame", low));
  }

  images.frames.resize(static_cast<std::size_t>(count));
  int beyond = 0;
  const auto place = [&](const Stems& stems, std::string ImageFiles::*side) {
    for (const auto& [stem, path] : stems) {
      const std::int64_t at = numbers->at(stem) - images.first_number;
      if (at >= 0 && at < count) {
        images.frames[static_cast<std::size_t>(at)].*side = path;
      } else {
        ++beyond;
      }
    }
  };
  place(left, &ImageFiles::left);
  place(right, &ImageFiles::right);
  if (beyond > 0) {
    images.remarks.push_back(
        fmt::format("{} images have no entry among the {} listed frames and are not read", beyond, count));
  }
  return images;
}

std::optional<ImageSize> common_image_size(const std::map<std::string, std::string>& images) {
  std::vector<const std::string*> files;
  files.reserve(images.size());
  for (const auto& [stem, path] : images) files.push_back(&path);
  const std::size_t probes = std::min(files.size(), kSizeProbes);
  std::map<std::pair<int, int>, int> votes;
  for (std::size_t k = 0; k < probes; ++k) {
    if (const auto size = read_image_size(*files[k * files.size() / probes])) ++votes[{size->width, size->height}];
  }
  const auto most =
      std::max_element(votes.begin(), votes.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (most == votes.end()) return std::nullopt;
  return ImageSize{most->first.first, most->first.second};
}

}  // namespace spartan::internal
