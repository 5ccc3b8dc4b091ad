#include "spartan/reconstruction/internal/matching/search_intervals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace spartan::internal::matching {
namespace {

constexpr int kCoarseTile = kTile / 2;
constexpr int kCore = kInterval - 2 * kMargin;  // disparities that an interval is chosen for

// How often each disparity occurs in the neighbourhood of a tile.
class Histogram {
 public:
  explicit Histogram(DisparityRange range) : range_(range), counts_(static_cast<std::size_t>(range.count()), 0) {}

  void clear() {
    if (low_ <= high_) std::fill(counts_.begin() + low_, counts_.begin() + high_ + 1, 0);
    low_ = range_.count();
    high_ = -1;
  }
  void add(int d) {
    ++counts_[static_cast<std::size_t>(d)];
    low_ = std::min(low_, d);
    high_ = std::max(high_, d);
  }
  // Takes out the kCore disparities in succession that occur most often, and returns the first; where several choices
  // are equal, the middle one. None where the histogram is empty.
  std::optional<int> take_most() {
    if (low_ > high_) return std::nullopt;
    int most = 0, from = 0, to = 0, inside = 0;
    for (int first = low_ - kCore + 1; first <= high_; ++first) {
      inside += at(first + kCore - 1) - at(first - 1);
      if (inside > most) {
        most = inside;
        from = to = first;
      } else if (inside == most && to == first - 1) {
        to = first;
      }
    }
    const int chosen = (from + to) / 2;
    for (int d = std::max(chosen, low_); d < std::min(chosen + kCore, high_ + 1); ++d)
      counts_[static_cast<std::size_t>(d)] = 0;
    return most > 0 ? std::optional(range_.min + chosen) : std::nullopt;
  }

 private:
  int at(int d) const { return d < low_ || d > high_ ? 0 : counts_[static_cast<std::size_t>(d)]; }

  DisparityRange range_;
  std::vector<int> counts_;
  int low_ = 0, high_ = -1;  // the disparities that occur
};

// Intervals around two choices of kCore disparities: inside of the range where it is wide enough, and apart.
TileIntervals intervals_around(int one, std::optional<int> other, DisparityRange range) {
  const int last = std::max(range.min, range.max + 1 - kInterval);
  const auto start = [&](int core) { return std::clamp(core - kMargin, range.min, last); };
  int a = start(one);
  // Without a second choice: above the first, or below it at the upper end of the range.
  int b = other ? start(*other) : a + kInterval <= last ? a + kInterval : a - kInterval;
  if (std::abs(a - b) < kInterval) b = b >= a ? a + kInterval : a - kInterval;
  if (b < a) std::swap(a, b);
  return {static_cast<std::int16_t>(a), static_cast<std::int16_t>(b)};
}

// Disparities of the fine level, relative to the smallest of the range, from those of a row of the coarse level;
// kUnknownDisparity where it is unknown.
constexpr std::int16_t kUnknownDisparity = -1;
void convert_row(const float* coarse, int width, DisparityRange range, std::int16_t* to) {
  const auto first = static_cast<float>(range.min), last = static_cast<float>(range.count() - 1);
  for (int x = 0; x < width; ++x) {
    // The nearest whole disparity: cut after half a pixel is added.
    const float d = std::min(std::max(2 * coarse[x] - first, 0.0F) + 0.5F, last);
    to[x] = std::isnan(coarse[x]) ? kUnknownDisparity : static_cast<std::int16_t>(d);
  }
}

// Counts the disparities of every second pixel, as on a checkerboard, of a tile and its neighbours.
void count(ImageView<const std::int16_t> disparities, int tile_x, int tile_y, Histogram& histogram) {
  const int x0 = std::max(0, (tile_x - 1) * kCoarseTile),
            x1 = std::min(disparities.width(), (tile_x + 2) * kCoarseTile);
  const int y0 = std::max(0, (tile_y - 1) * kCoarseTile),
            y1 = std::min(disparities.height(), (tile_y + 2) * kCoarseTile);
  for (int y = y0; y < y1; ++y) {
    const std::int16_t* const row = disparities.row(y);
    for (int x = x0 + ((x0 + y) & 1); x < x1; x += 2) {
      if (row[x] != kUnknownDisparity) histogram.add(row[x]);
    }
  }
}

}  // namespace

Transition transition(const TileIntervals& from, const TileIntervals& to) {
  return {to.first - from.first, to.first - from.second, to.second - from.first, to.second - from.second};
}

Image<TileIntervals> choose_intervals(ImageView<const float> coarse, ImageSize size, DisparityRange range,
                                      const ThreadPool& workers) {
  Image<TileIntervals> tiles((size.width + kTile - 1) / kTile, (size.height + kTile - 1) / kTile);
  Image<std::int16_t> disparities(coarse.width(), coarse.height());
  workers.parallel_for(0, coarse.height(), 64, [&](int from, int to) {
    for (int y = from; y < to; ++y) convert_row(coarse.row(y), coarse.width(), range, disparities.row(y));
  });
  workers.parallel_for(0, tiles.height(), 8, [&](int from, int to) {
    Histogram histogram(range);
    for (int y = from; y < to; ++y) {
      TileIntervals last = intervals_around(range.min, std::nullopt, range);
      for (int x = 0; x < tiles.width(); ++x) {
        histogram.clear();
        count(disparities, x, y, histogram);
        if (const auto first = histogram.take_most()) last = intervals_around(*first, histogram.take_most(), range);
        tiles(x, y) = last;
      }
    }
  });
  return tiles;
}

}  // namespace spartan::internal::matching
