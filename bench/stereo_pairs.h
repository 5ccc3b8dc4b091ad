// Real stereo pairs with ground truth for benchmarks.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/eval/disparity_metrics.h"
#include "spartan/image_io/image_io.h"

namespace spartan {

/// A rectified pair with its ground truth.
struct Pair {
  std::string name;
  std::filesystem::path folder;
  Image<std::uint8_t> left, right;
  Image<float> truth;
  Image<std::uint8_t> mask;
  int disparities = 0;  // search range: largest true disparity + 8, rounded up to a multiple of 16
};

template <class T>
T must(Result<T> result) {
  if (result) return std::move(*result);
  fmt::print(stderr, "{}\n", result.error().message());
  std::exit(3);
}

inline void set_search_range(Pair& pair) {
  float largest = 0;
  for (int y = 0; y < pair.truth.height(); ++y) {
    for (int x = 0; x < pair.truth.width(); ++x) {
      if (std::isfinite(pair.truth(x, y))) largest = std::max(largest, pair.truth(x, y));
    }
  }
  pair.disparities = (static_cast<int>(std::ceil(largest)) + 8 + 15) / 16 * 16;
}

inline Pair load_middlebury(const std::filesystem::path& folder) {
  Pair pair;
  pair.name = folder.filename().string();
  pair.folder = folder;
  pair.left = must(read_gray8((folder / "view1.png").string()));
  pair.right = must(read_gray8((folder / "view5.png").string()));
  pair.truth = must(read_disparity((folder / "disp1.png").string(), 3));
  const auto other = must(read_disparity((folder / "disp5.png").string(), 3));
  pair.mask = Image<std::uint8_t>(pair.truth.size());
  for (int y = 0; y < pair.truth.height(); ++y) {
    for (int x = 0; x < pair.truth.width(); ++x) {
      const float d = pair.truth(x, y);
      if (!std::isfinite(d)) continue;
      const int right_x = x - static_cast<int>(std::lround(d));
      const bool both = right_x >= 0 && std::abs(other(right_x, y) - d) <= 1.0F;
      pair.mask(x, y) = both ? kMaskSeenByBoth : kMaskOccluded;
    }
  }
  set_search_range(pair);
  return pair;
}

inline Pair load_eth3d(const std::filesystem::path& folder) {
  Pair pair;
  pair.name = folder.filename().string();
  pair.folder = folder;
  pair.left = must(read_gray8((folder / "im0.png").string()));
  pair.right = must(read_gray8((folder / "im1.png").string()));
  pair.truth = must(read_pfm((folder / "disp0GT.pfm").string()));
  pair.mask = must(read_truth_mask((folder / "mask0nocc.png").string()));
  set_search_range(pair);
  return pair;
}

/// Middlebury pairs, then ETH3D pairs, each sorted by name.
inline std::vector<Pair> load_stereo_pairs(const std::filesystem::path& data) {
  std::vector<std::filesystem::path> folders;
  for (const char* set : {"middlebury", "eth3d"}) {
    std::vector<std::filesystem::path> found;
    for (const auto& entry : std::filesystem::directory_iterator(data / set)) {
      if (entry.is_directory() && !std::filesystem::is_empty(entry.path()) &&
          (std::filesystem::exists(entry.path() / "view1.png") || std::filesystem::exists(entry.path() / "im0.png"))) {
        found.push_back(entry.path());
      }
    }
    std::sort(found.begin(), found.end());
    folders.insert(folders.end(), found.begin(), found.end());
  }
  std::vector<Pair> pairs;
  pairs.reserve(folders.size());
  for (const std::filesystem::path& folder : folders) {
    pairs.push_back(std::filesystem::exists(folder / "view1.png") ? load_middlebury(folder) : load_eth3d(folder));
  }
  return pairs;
}

}  // namespace spartan
