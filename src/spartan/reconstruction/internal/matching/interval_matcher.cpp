#include "spartan/reconstruction/internal/matching/interval_matcher.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "spartan/reconstruction/internal/matching/row_padding.h"
#include "spartan/reconstruction/internal/subpixel.h"

namespace spartan::internal::matching {
static_assert(kTile == kRowsAtOnce);  // rows that are matched together have the same intervals

// Matches one strip.
class IntervalMatcher::StripMatching {
 public:
  StripMatching(IntervalMatcher& matcher, ImageView<const TileIntervals> tiles, const StripRows& rows,
                StripBuffers& buffers, const Matches& to)
      : m_(matcher),
        tiles_(tiles),
        s_(buffers),
        to_(to),
        width_(matcher.census_.size().width),
        costs_{buffers, rows, static_cast<std::ptrdiff_t>(width_) * kLevels} {
    resize();
  }

  // The steps of match_strip().
  void compute_costs(int y);
  void begin_sweep() { std::fill(s_.paths.begin(), s_.paths.end(), std::uint8_t{0}); }
  void sweep_row(int y, int before, bool add);
  void along_rows(int from, int to);
  void select(int y);

 private:
  std::size_t path_bytes() const { return static_cast<std::size_t>(width_ + 2) * kLevels + kRowPadding; }
  // Path costs of a direction that were written in the row before (0) and are written in this row (1). Pixel 0 is the
  // second one, because diagonal paths move by a column.
  std::uint8_t* path(int direction, int now) {
    return s_.paths.data() + static_cast<std::size_t>(2 * direction + (turn_ ^ now)) * path_bytes() + kLevels;
  }
  std::uint8_t* p2(int index) { return s_.p2.data() + static_cast<std::size_t>(index) * p2_bytes() + kRowPadding; }
  std::size_t p2_bytes() const { return static_cast<std::size_t>(width_ + 2 * kRowPadding); }

  void resize();
  void replace_outside(int tile, int start, std::uint8_t* costs) const;
  void enter_row(int y, int before);
  void compute_p2(const std::uint8_t* here, const std::uint8_t* before, int index);
  static int winner(const SelectRow& row, int x) {
    const int level = row.winner[x] % kLevels;
    return (level < kInterval ? row.first[x] : row.second[x]) + level % kInterval;
  }
  void refine(const SelectRow& row, int y);
  void set_starts(int tile_row);

  IntervalMatcher& m_;
  ImageView<const TileIntervals> tiles_;
  StripBuffers& s_;
  const Matches& to_;
  int width_;
  StripCosts costs_;
  int turn_ = 0;
  int starts_of_ = -1;  // the row of tiles whose intervals `starts` holds
};

void IntervalMatcher::StripMatching::resize() {
  costs_.resize();
  at_least(2 * kDirections * path_bytes(), s_.paths);
  at_least(2 * kRowsAtOnce * p2_bytes(), s_.p2);
  at_least(2 * static_cast<std::size_t>(width_), s_.starts);
  at_least(static_cast<std::size_t>(width_), s_.winners);
  at_least(static_cast<std::size_t>(width_ + m_.range_.count() + 4 * kInterval), s_.right_best);
}

void IntervalMatcher::StripMatching::set_starts(int tile_row) {
  if (starts_of_ == tile_row) return;
  starts_of_ = tile_row;
  for (int x = 0; x < width_; ++x) {
    const TileIntervals& tile = tiles_(x / kTile, tile_row);
    s_.starts[static_cast<std::size_t>(x)] = tile.first;
    s_.starts[static_cast<std::size_t>(width_ + x)] = tile.second;
  }
}

void IntervalMatcher::StripMatching::compute_costs(int y) {
  set_starts(y / kTile);
  CostRow row{};
  row.width = width_;
  row.cost = costs_.cost(y);
  row.out_of_view = m_.penalties_.out_of_view;
  row.first = s_.starts.data();
  row.second = row.first + width_;
  for (int p = 0; p < kPlanes; ++p) {
    row.left[p] = m_.census_.left_plane(p, y);
    row.right[p] = m_.census_.right_plane(p, y);
  }
  m_.kernels_.cost_row(row);
  for (int tile = 0; tile < tiles_.width(); ++tile) {
    const TileIntervals& starts = tiles_(tile, y / kTile);
    replace_outside(tile, starts.first, row.cost);
    replace_outside(tile, starts.second, row.cost + kInterval);
  }
}

// Levels of a tile outside of the search range, and those whose right pixel lies right of the image.
void IntervalMatcher::StripMatching::replace_outside(int tile, int start, std::uint8_t* costs) const {
  const int from = tile * kTile, to = std::min(width_, from + kTile), end = start + kInterval - 1;
  if (start >= m_.range_.min && end <= m_.range_.max && start > to - 1 - width_) return;
  for (int x = from; x < to; ++x) {
    for (int d = start; d <= end; ++d) {
      std::uint8_t& cost = costs[static_cast<std::ptrdiff_t>(x) * kLevels + d - start];
      if (d < m_.range_.min || d > m_.range_.max) {
        cost = kNever;
      } else if (d <= x - width_) {
        cost = m_.penalties_.out_of_view;
      }
    }
  }
}

// Path costs of the row before are re-expressed in the intervals of this row's tiles. Element x of direction 0 comes
// from column x − 1, of direction 2 from column x + 1.
void IntervalMatcher::StripMatching::enter_row(int y, int before) {
  const int row = y / kTile, row_before = before / kTile;
  const auto apply = [&](int direction, int x, int count, const TileIntervals& old, const TileIntervals& now) {
    if (count > 0 && old != now)
      m_.kernels_.apply({path(direction, 0) + static_cast<std::ptrdiff_t>(x) * kLevels, count, transition(old, now)});
  };
  for (int t = 0; t < tiles_.width(); ++t) {
    const TileIntervals& now = tiles_(t, row);
    const int x0 = t * kTile, x1 = std::min(width_, x0 + kTile);
    const TileIntervals& above = tiles_(t, row_before);
    apply(0, x0 + 1, x1 - x0 - 1, above, now);
    apply(1, x0, x1 - x0, above, now);
    apply(2, x0, x1 - x0 - 1, above, now);
    if (t > 0) apply(0, x0, 1, tiles_(t - 1, row_before), now);
    if (t + 1 < tiles_.width()) apply(2, x1 - 1, 1, tiles_(t + 1, row_before), now);
  }
}

void IntervalMatcher::StripMatching::compute_p2(const std::uint8_t* here, const std::uint8_t* before, int index) {
  m_.kernels_.p2_row({here, before, m_.penalties_.p2.data(), p2(index), width_});
}

void IntervalMatcher::StripMatching::sweep_row(int y, int before, bool add) {
  if (before != y) enter_row(y, before);
  const std::uint8_t* const here = m_.census_.gray(y);
  const std::uint8_t* const there = m_.census_.gray(before);
  VerticalRow row{};
  row.cost = costs_.cost(y);
  row.sum = costs_.sum(y);
  row.width = width_;
  row.p1 = m_.penalties_.p1;
  row.add = add;
  for (int direction = 0; direction < kDirections; ++direction) {
    compute_p2(here, there + direction - 1, direction);
    row.p2[direction] = p2(direction);
    row.from[direction] = path(direction, 0);
    row.to[direction] = path(direction, 1) - (direction - 1) * kLevels;
  }
  m_.kernels_.vertical_row(row);
  turn_ ^= 1;
  // Diagonal paths begin at the left and right border.
  std::memset(path(0, 0), 0, kLevels);
  std::memset(path(2, 0) + costs_.row_costs - kLevels, 0, kLevels);
}

void IntervalMatcher::StripMatching::along_rows(int from, int to) {
  const int tile_row = from / kTile;
  s_.runs.clear();
  for (int t = 0; t < tiles_.width(); ++t) {
    const int x0 = t * kTile, x1 = std::min(width_, x0 + kTile);
    if (t > 0 && tiles_(t, tile_row) == tiles_(t - 1, tile_row)) {
      s_.runs.back().to = x1;
      continue;
    }
    ColumnRun run{x0, x1, {}, {}};
    if (t > 0) {
      run.from_left = transition(tiles_(t - 1, tile_row), tiles_(t, tile_row));
      s_.runs.back().from_right = transition(tiles_(t, tile_row), tiles_(t - 1, tile_row));
    }
    s_.runs.push_back(run);
  }
  HorizontalRows rows{};
  rows.runs = s_.runs.data();
  rows.run_count = static_cast<int>(s_.runs.size());
  rows.p1 = m_.penalties_.p1;
  for (int i = 0; i < kRowsAtOnce; ++i) {
    const int y = std::min(from + i, to - 1);
    const std::uint8_t* const gray = m_.census_.gray(y);
    compute_p2(gray, gray - 1, 2 * i);
    compute_p2(gray, gray + 1, 2 * i + 1);
    rows.cost[i] = costs_.cost(y);
    rows.p2_from_left[i] = p2(2 * i);
    rows.p2_from_right[i] = p2(2 * i + 1);
    rows.sum[i] = from + i < to ? costs_.sum(y) : s_.unused_sums.data();
  }
  m_.kernels_.horizontal_rows(rows);
}

void IntervalMatcher::StripMatching::select(int y) {
  set_starts(y / kTile);
  SelectRow row{};
  row.sum = costs_.sum(y);
  row.first = s_.starts.data();
  row.second = row.first + width_;
  row.winner = s_.winners.data();
  row.width = width_;
  const bool whole_pixels = to_.right_distance.empty();
  if (!whole_pixels) {
    std::fill(s_.right_best.begin(), s_.right_best.end(), std::numeric_limits<std::uint16_t>::max());
    // The smallest start is at most an interval below the range, see TileIntervals.
    row.right_best = s_.right_best.data() + width_ - 1 - (m_.range_.min - kInterval);
  }
  m_.kernels_.select_row(row);
  float* const disparity = to_.disparity.row(y);
  for (int x = 0; x < width_; ++x) {
    const int d = winner(row, x);
    const bool inside = d <= x && d > x - width_;
    disparity[x] = inside ? static_cast<float>(d) : std::numeric_limits<float>::quiet_NaN();
  }
  if (!whole_pixels) refine(row, y);
}

// Sub-pixel part and right distance of the winners.
void IntervalMatcher::StripMatching::refine(const SelectRow& row, int y) {
  float* const disparity = to_.disparity.row(y);
  std::uint8_t* const right_distance = to_.right_distance.row(y);
  for (int x = 0; x < width_; ++x) {
    // right_best holds the column modulo kLevels.
    const int apart = (row.right_best[winner(row, x) - x] - x) & (kLevels - 1);
    right_distance[x] = static_cast<std::uint8_t>(std::min(apart, kLevels - apart));
    const int level = row.winner[x] % kLevels, k = level % kInterval;
    if (k == 0 || k + 1 == kInterval) continue;
    const std::uint16_t* const sums = row.sum + static_cast<std::ptrdiff_t>(x) * kLevels;
    disparity[x] += equiangular_offset(sums[sum_index(level - 1)], sums[sum_index(level)], sums[sum_index(level + 1)]);
  }
}

IntervalMatcher::IntervalMatcher(const Penalties& penalties, const Kernels& kernels, const ThreadPool& workers)
    : penalties_(penalties), kernels_(kernels), workers_(workers), census_(kernels.census_row, workers) {}

void IntervalMatcher::match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                            ImageView<const TileIntervals> tiles, DisparityRange range,
                            std::vector<StripBuffers>& strips, const Matches& to) {
  range_ = range;
  // Intervals reach at most an interval beyond the range, see TileIntervals.
  census_.compute(left, right, {range.min - kInterval, range.max + 2 * kInterval});
  const int rows = strip_rows(left.height(), std::int64_t{left.width()} * kLevels);
  for_each_strip(left.height(), rows, workers_, strips, [&](const StripRows& strip, StripBuffers& buffers) {
    StripMatching matching(*this, tiles, strip, buffers, to);
    match_strip(strip, matching);
  });
}

std::int64_t IntervalMatcher::strip_bytes(ImageSize size, DisparityRange range, int threads) {
  const std::int64_t w = size.width + 4, h = size.height,
                     rows = strip_rows(size.height, std::int64_t{size.width} * kLevels);
  const std::int64_t own = w * std::min(rows, h), with_margins = w * std::min(rows + 2 * kStripMargin, h);
  const std::int64_t strip =
      kLevels * (with_margins + 2 * own + 10 * w) + 26 * (w + 4 * kRowPadding) + 2 * (range.count() + 4 * kInterval);
  return std::min<std::int64_t>(threads, (h + rows - 1) / rows) * strip;
}

std::int64_t IntervalMatcher::memory_bytes(ImageSize size, DisparityRange range) {
  return CensusPair::memory_bytes(size, {range.min - kInterval, range.max + 2 * kInterval});
}

std::size_t IntervalMatcher::buffer_bytes() const {
  return census_.buffer_bytes();
}

}  // namespace spartan::internal::matching
