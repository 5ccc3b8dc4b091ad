#include "spartan/reconstruction/internal/matching/full_range_matcher.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "spartan/reconstruction/internal/matching/image_bytes.h"
#include "spartan/reconstruction/internal/matching/row_padding.h"
#include "spartan/reconstruction/internal/subpixel.h"

namespace spartan::internal::matching {
namespace {

// At least one level behind the range.
int levels_of(DisparityRange range) {
  return (range.count() + kLevelStep) / kLevelStep * kLevelStep;
}

}  // namespace

// Matches one strip.
class FullRangeMatcher::StripMatching {
 public:
  StripMatching(FullRangeMatcher& matcher, const StripRows& rows, StripBuffers& buffers)
      : m_(matcher),
        s_(buffers),
        width_(matcher.census_.size().width),
        levels_(matcher.levels_),
        costs_{buffers, rows, static_cast<std::ptrdiff_t>(width_) * levels_} {
    costs_.resize();
    at_least(2 * kDirections * path_bytes(), s_.paths);
    at_least(2 * kDirections * minima_bytes(), s_.minima);
    at_least(2 * kRowsAtOnce * p2_bytes(), s_.p2);
    at_least(2 * kRowsAtOnce * slot_bytes(levels_), s_.slots);
  }

  // The steps of match_strip().
  void compute_costs(int y);
  void begin_sweep();
  void sweep_row(int y, int before, bool add);
  void along_rows(int from, int to);
  void select(int y);

 private:
  // One pixel before the first and one behind the last, where diagonal paths begin.
  std::size_t path_bytes() const { return static_cast<std::size_t>((width_ + 2) * levels_) + 2 * kRowPadding; }
  std::size_t minima_bytes() const { return static_cast<std::size_t>(width_) + 2 * kRowPadding; }
  std::size_t p2_bytes() const { return static_cast<std::size_t>(width_) + 2 * kRowPadding; }
  // Path costs of a direction that were written in the row before (0) and are written in this row (1).
  std::uint8_t* path(int direction, int now) {
    return s_.paths.data() + static_cast<std::size_t>(2 * direction + (turn_ ^ now)) * path_bytes() + kRowPadding +
           levels_;
  }
  std::uint8_t* minima(int direction, int now) {
    return s_.minima.data() + static_cast<std::size_t>(2 * direction + (turn_ ^ now)) * minima_bytes() + kRowPadding;
  }
  std::uint8_t* p2(int index) { return s_.p2.data() + static_cast<std::size_t>(index) * p2_bytes() + kRowPadding; }

  void begin_path(std::uint8_t* pixel) const;

  FullRangeMatcher& m_;
  StripBuffers& s_;
  int width_, levels_;
  StripCosts costs_;
  int turn_ = 0;
};

void FullRangeMatcher::StripMatching::compute_costs(int y) {
  FullCostRow row{};
  row.width = width_;
  row.levels = levels_;
  row.cost = costs_.cost(y);
  for (int p = 0; p < kPlanes; ++p) {
    row.left[p] = m_.census_.left_plane(p, y);
    row.right[p] = m_.census_.right_plane(p, y) + m_.range_.min;
  }
  m_.full_.cost_row(row);
  const int count = m_.range_.count();
  for (int x = 0; x < width_; ++x) {
    std::uint8_t* const costs = row.cost + static_cast<std::ptrdiff_t>(x) * levels_;
    // Level k is matched to the right column x − min − k: outside of the image for k > x − min and k < x − min − w + 1.
    const int last = std::clamp(x - m_.range_.min + 1, 0, count);
    const int first = std::clamp(x - m_.range_.min - width_ + 1, 0, count);
    std::memset(costs, m_.penalties_.out_of_view, static_cast<std::size_t>(first));
    std::memset(costs + last, m_.penalties_.out_of_view, static_cast<std::size_t>(count - last));
    std::memset(costs + count, kNever, static_cast<std::size_t>(levels_ - count));
  }
}

// L' = 0 where a path begins.
void FullRangeMatcher::StripMatching::begin_path(std::uint8_t* pixel) const {
  const int count = m_.range_.count();
  std::memset(pixel, 0, static_cast<std::size_t>(count));
  std::memset(pixel + count, kNever, static_cast<std::size_t>(levels_ - count));
}

void FullRangeMatcher::StripMatching::begin_sweep() {
  for (int direction = 0; direction < kDirections; ++direction) {
    for (const int now : {0, 1}) {
      std::uint8_t* const first = path(direction, now) - levels_;
      std::memset(first - kRowPadding, kNever, kRowPadding);
      for (int x = 0; x < width_ + 2; ++x) begin_path(first + static_cast<std::ptrdiff_t>(x) * levels_);
      std::memset(minima(direction, now) - kRowPadding, 0, minima_bytes());
    }
  }
}

void FullRangeMatcher::StripMatching::sweep_row(int y, int before, bool add) {
  const std::uint8_t* const here = m_.census_.gray(y);
  const std::uint8_t* const there = m_.census_.gray(before);
  FullVerticalRow row{};
  row.cost = costs_.cost(y);
  row.sum = costs_.sum(y);
  row.width = width_;
  row.levels = levels_;
  row.p1 = m_.penalties_.p1;
  row.add = add;
  for (int direction = 0; direction < kDirections; ++direction) {
    const int shift = direction - 1;
    m_.kernels_.p2_row({here, there + shift, m_.penalties_.p2.data(), p2(direction), width_});
    row.p2[direction] = p2(direction);
    row.from[direction] = path(direction, 0) + shift * levels_;
    row.from_min[direction] = minima(direction, 0) + shift;
    row.to[direction] = path(direction, 1);
    row.to_min[direction] = minima(direction, 1);
  }
  m_.full_.vertical_row(row);
  turn_ ^= 1;
}

void FullRangeMatcher::StripMatching::along_rows(int from, int to) {
  FullHorizontalRows rows{};
  rows.slots = s_.slots.data();
  rows.width = width_;
  rows.levels = levels_;
  rows.p1 = m_.penalties_.p1;
  for (int i = 0; i < kRowsAtOnce; ++i) {
    const int y = std::min(from + i, to - 1);
    const std::uint8_t* const gray = m_.census_.gray(y);
    m_.kernels_.p2_row({gray, gray - 1, m_.penalties_.p2.data(), p2(2 * i), width_});
    m_.kernels_.p2_row({gray, gray + 1, m_.penalties_.p2.data(), p2(2 * i + 1), width_});
    rows.cost[i] = costs_.cost(y);
    rows.p2_from_left[i] = p2(2 * i);
    rows.p2_from_right[i] = p2(2 * i + 1);
    rows.sum[i] = from + i < to ? costs_.sum(y) : s_.unused_sums.data();
  }
  m_.full_.horizontal_rows(rows);
}

void FullRangeMatcher::StripMatching::select(int y) {
  float* const disparity = m_.disparity_.row(y);
  for (int x = 0; x < width_; ++x) {
    const std::uint16_t* const sums = costs_.sum(y) + static_cast<std::ptrdiff_t>(x) * levels_;
    const int level = m_.full_.find_winner(sums, levels_);
    const int d = m_.range_.min + level, matched = x - d;
    disparity[x] = matched < 0 || matched >= width_
                       ? std::numeric_limits<float>::quiet_NaN()
                       : static_cast<float>(d) + subpixel_offset(sums, level, m_.range_.count());
  }
}

FullRangeMatcher::FullRangeMatcher(const Penalties& penalties, const Kernels& kernels,
                                   const FullRangeKernels& full_range_kernels, const ThreadPool& workers)
    : penalties_(penalties),
      kernels_(kernels),
      full_(full_range_kernels),
      workers_(workers),
      census_(kernels.census_row, workers) {}

ImageView<const float> FullRangeMatcher::match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                               DisparityRange range, std::vector<StripBuffers>& strips) {
  range_ = range;
  levels_ = levels_of(range);
  census_.compute(left, right, {range.min, range.min + levels_});
  if (disparity_.size() != left.size()) disparity_ = Image<float>(left.size());
  const int rows = strip_rows(left.height(), std::int64_t{left.width()} * levels_);
  for_each_strip(left.height(), rows, workers_, strips, [&](const StripRows& strip, StripBuffers& buffers) {
    StripMatching matching(*this, strip, buffers);
    match_strip(strip, matching);
  });
  return disparity_;
}

std::size_t FullRangeMatcher::buffer_bytes() const {
  return census_.buffer_bytes() + bytes_of(disparity_);
}

std::int64_t FullRangeMatcher::memory_bytes(ImageSize size, DisparityRange range) {
  return CensusPair::memory_bytes(size, {range.min, range.min + levels_of(range)}) +
         std::int64_t{4} * (size.width + 16) * size.height;
}

std::int64_t FullRangeMatcher::strip_bytes(ImageSize size, DisparityRange range, int threads) {
  const std::int64_t levels = levels_of(range), row = levels * size.width, h = size.height;
  const std::int64_t rows = strip_rows(size.height, row);
  const std::int64_t strip = row * (std::min(rows + 2 * kStripMargin, h) + 2 * std::min(rows, h) + 2) +
                             6 * (levels * (size.width + 2) + 2 * kRowPadding) + 22 * (size.width + 2 * kRowPadding) +
                             16 * static_cast<std::int64_t>(slot_bytes(static_cast<int>(levels)));
  return std::min<std::int64_t>(threads, (h + rows - 1) / rows) * (strip + 4 * kRowPadding);
}

}  // namespace spartan::internal::matching
