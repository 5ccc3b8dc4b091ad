#include <algorithm>
#include <bit>
#include <vector>

#include "spartan/slam/global_map.h"

namespace spartan {
namespace {

constexpr std::size_t kBins = 1U << 16U;

// The bits of non-negative floats, read as integers, have the same order as the floats.
std::uint32_t bits_of(float value) {
  return std::bit_cast<std::uint32_t>(value);
}

struct BinIndex {
  std::uint32_t bin = 0;
  std::int64_t index = 0;  // in the bin
};

// The bin that contains the value with this index in sorted order; `counts` sum up to more than the index.
BinIndex find_index(const std::vector<std::int64_t>& counts, std::int64_t index) {
  std::uint32_t bin = 0;
  for (; index >= counts[bin]; ++bin) index -= counts[bin];
  return {bin, index};
}

template <class Work>
Status each_known_cell(GlobalMap& map, int side, const Work& work) {
  for (const LatticeWindow& window : map.pieces(side)) {
    const auto view = map.view(window);
    if (!view) return failure(view);
    for (int r = 0; r < window.height; ++r) {
      for (int c = 0; c < window.width; ++c) {
        if (view->count(c, r) > 0) work(*view, c, r);
      }
    }
  }
  return {};
}

}  // namespace

Result<MapStatistics> map_statistics(GlobalMap& map, int side) {
  MapStatistics statistics;
  std::vector<std::int64_t> upper(kBins), lower(kBins);
  const Status counted = each_known_cell(map, side, [&](const MapView& view, int c, int r) {
    const float z = view.elevation_m(c, r);
    statistics.min_elevation_m = statistics.known == 0 ? z : std::min(statistics.min_elevation_m, z);
    statistics.max_elevation_m = statistics.known == 0 ? z : std::max(statistics.max_elevation_m, z);
    ++statistics.known;
    ++statistics.cells[static_cast<std::size_t>(view.kind(c, r))];
    ++upper[bits_of(view.variance_m2(c, r)) / kBins];
  });
  if (!counted) return failure(counted);
  if (statistics.known == 0) return statistics;
  // The variances may be too many to store: exact median by two histograms, first of the upper bits, then of the lower
  // bits of those values that share the median's upper bits.
  const BinIndex middle = find_index(upper, statistics.known / 2);
  const Status found = each_known_cell(map, side, [&](const MapView& view, int c, int r) {
    const std::uint32_t bits = bits_of(view.variance_m2(c, r));
    if (bits / kBins == middle.bin) ++lower[bits % kBins];
  });
  if (!found) return failure(found);
  const std::uint32_t median = middle.bin * static_cast<std::uint32_t>(kBins) + find_index(lower, middle.index).bin;
  statistics.median_variance_m2 = std::bit_cast<float>(median);
  return statistics;
}

}  // namespace spartan
