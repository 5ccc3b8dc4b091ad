#include "spartan/reconstruction/internal/matching/block_matcher.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "spartan/reconstruction/internal/matching/image_bytes.h"
#include "spartan/reconstruction/internal/matching/row_padding.h"
#include "spartan/reconstruction/internal/subpixel.h"

namespace spartan::internal::matching {
namespace {

// Binomial filters at these steps have together the variance of a Gaussian of σ = √(½ (1 + 4 + 16)) = 3.2 pixels.
constexpr std::array<int, 3> kSteps{1, 2, 4};
constexpr int kRadius = 7;                // of all steps
constexpr int kBlockPad = kRowPadding;    // columns before the first pixel; twice as many behind the last
constexpr int kStripRows = 64;            // few enough for a strip's buffers to stay in a cache
constexpr std::uint8_t kOutOfView = 248;  // cost where x − d lies outside of the right image: the largest difference
constexpr std::uint8_t kNoCost = 255;
constexpr std::uint16_t kNoPlane = 0xFFFF;
constexpr int kMostRightDistance = 16;

void set_all(std::uint8_t value, Image<std::uint8_t>& image) {
  std::memset(image.data(), value, bytes_of(image));
}

}  // namespace

BlockMatcher::BlockMatcher(BlockKernels kernels, const ThreadPool& workers) : kernels_(kernels), workers_(workers) {}

void BlockMatcher::resize(ImageSize size) {
  if (size == size_) return;
  size_ = {};  // stays so if an allocation fails
  for (Image<std::uint8_t>* image : {&left_, &right_, &means_[0], &means_[1]})
    *image = Image<std::uint8_t>(size.width + 3 * kBlockPad, size.height);
  size_ = size;
}

void BlockMatcher::resize(StripBuffers& b) const {
  const int wide = size_.width + 3 * kBlockPad;
  if (b.right_index.width() == wide) return;
  b.right_index = {};  // stays so if an allocation fails
  for (Image<std::uint8_t>* image : {&b.costs, &b.smoothed})
    *image = Image<std::uint8_t>(wide, kStripRows + 2 * kRadius);
  for (Image<std::uint8_t>* image : {&b.best, &b.before, &b.after, &b.previous, &b.right_best})
    *image = Image<std::uint8_t>(wide, kStripRows);
  b.index = Image<std::uint16_t>(wide, kStripRows);
  b.right_index = Image<std::uint16_t>(wide, kStripRows);
}

// Sums of differences over the window of each pixel, for one disparity: rows of `costs` from kRadius on.
void BlockMatcher::sum_costs(const Strip& strip, int disparity, StripBuffers& b) const {
  const int w = size_.width, rows = strip.to - strip.from + 2 * kRadius;
  // Columns whose partner lies inside of the right image; differences are taken a margin around the image.
  const int first = std::max(-kRadius - 1, disparity), end = std::min(w + kRadius + 1, w + disparity);
  const int margin = kRadius + 1;
  for (int row = 0; row < rows; ++row) {
    const int y = std::clamp(strip.from + row - kRadius, 0, size_.height - 1);
    std::uint8_t* const cost = b.costs.row(row) + kBlockPad;
    std::uint8_t* const smoothed = b.smoothed.row(row) + kBlockPad;
    kernels_.difference_row(
        {left_.row(y) + kBlockPad + first, right_.row(y) + kBlockPad + first - disparity, cost + first, end - first});
    std::memset(cost - margin, kOutOfView, static_cast<std::size_t>(first + margin));
    std::memset(cost + end, kOutOfView, static_cast<std::size_t>(w + margin - end));
    std::uint8_t *from = cost, *to = smoothed;
    int reach = margin;
    for (const int step : kSteps) {
      reach -= step;
      kernels_.average_row({from - reach - step, from - reach, from - reach + step, to - reach, w + 2 * reach});
      std::swap(from, to);
    }
  }
  // Three steps along the rows end in `smoothed`.
  Image<std::uint8_t>*from = &b.smoothed, *to = &b.costs;
  int reach = 0;
  for (const int step : kSteps) {
    reach += step;
    for (int row = reach; row < rows - reach; ++row) {
      kernels_.average_row({from->row(row - step) + kBlockPad, from->row(row) + kBlockPad,
                            from->row(row + step) + kBlockPad, to->row(row) + kBlockPad, w});
    }
    std::swap(from, to);
  }
}

void BlockMatcher::match_plane(const Strip& strip, int index, StripBuffers& b) const {
  const int disparity = range_.min + index;
  const int first = std::max(0, disparity), end = std::min(size_.width, size_.width + disparity);
  if (first >= end) return;
  sum_costs(strip, disparity, b);
  for (int row = 0; row < strip.to - strip.from; ++row) {
    const auto at = [&](auto& image) { return image.row(row) + kBlockPad + first; };
    PlaneUpdate update{};
    update.cost = b.costs.row(row + kRadius) + kBlockPad + first;
    update.left = {at(b.best), at(b.before), at(b.after), at(b.previous), at(b.index)};
    update.right_best = at(b.right_best) - disparity;
    update.right_index = at(b.right_index) - disparity;
    update.width = end - first;
    update.index = index;
    kernels_.update_row(update);
  }
}

void BlockMatcher::select(const Strip& strip, const StripBuffers& b, const Matches& to) const {
  for (int y = strip.from; y < strip.to; ++y) {
    const int row = y - strip.from;
    const auto at = [&](const auto& image) { return image.row(row) + kBlockPad; };
    const auto *const best = at(b.best), *const before = at(b.before), *const after = at(b.after);
    const auto *const index = at(b.index), *const right_index = at(b.right_index);
    for (int x = 0; x < size_.width; ++x) {
      if (index[x] == kNoPlane) {
        to.disparity(x, y) = std::numeric_limits<float>::quiet_NaN();
        to.right_distance(x, y) = kMostRightDistance;
        continue;
      }
      const int disparity = range_.min + index[x];
      const bool inner = before[x] != kNoCost && after[x] != kNoCost;
      const float offset = inner ? equiangular_offset(before[x], best[x], after[x]) : 0.0F;
      to.disparity(x, y) = static_cast<float>(disparity) + offset;
      // The right pixel has a plane, because this pixel has one at it.
      const int distance = std::abs(index[x] - right_index[x - disparity]);
      to.right_distance(x, y) = static_cast<std::uint8_t>(std::min(distance, kMostRightDistance));
    }
  }
}

void BlockMatcher::match_strip(const Strip& strip, StripBuffers& b, const Matches& to) const {
  resize(b);
  for (Image<std::uint8_t>* image : {&b.best, &b.before, &b.after, &b.previous, &b.right_best})
    set_all(kNoCost, *image);
  for (int row = 0; row < kStripRows; ++row) std::fill_n(b.index.row(row), b.index.width(), kNoPlane);
  for (int index = 0; index < range_.count(); ++index) match_plane(strip, index, b);
  select(strip, b, to);
}

// Gray levels without their mean over the window, around 128: offsets between the cameras and vignetting cancel.
void BlockMatcher::prepare(ImageView<const std::uint8_t> from, Image<std::uint8_t>& to) {
  const int w = size_.width, h = size_.height;
  workers_.parallel_for(0, h, 64, [&](int first, int end) {
    for (int y = first; y < end; ++y) {
      std::uint8_t *a = to.row(y) + kBlockPad, *b = means_[0].row(y) + kBlockPad;
      std::memset(a - kBlockPad, from(0, y), kBlockPad);
      std::memcpy(a, from.row(y), static_cast<std::size_t>(w));
      std::memset(a + w, from(w - 1, y), kBlockPad);
      int reach = kRadius;
      for (const int step : kSteps) {  // three: they end in means_[0]
        reach -= step;
        kernels_.average_row({a - reach - step, a - reach, a - reach + step, b - reach, w + 2 * reach});
        std::swap(a, b);
      }
    }
  });
  int current = 0;
  for (const int step : kSteps) {
    const Image<std::uint8_t>& source = means_[static_cast<std::size_t>(current)];
    Image<std::uint8_t>& target = means_[static_cast<std::size_t>(1 - current)];
    workers_.parallel_for(0, h, 64, [&](int first, int end) {
      for (int y = first; y < end; ++y) {
        const auto row = [&](int at) { return source.row(std::clamp(at, 0, h - 1)) + kBlockPad; };
        kernels_.average_row({row(y - step), row(y), row(y + step), target.row(y) + kBlockPad, w});
      }
    });
    current = 1 - current;
  }
  workers_.parallel_for(0, h, 64, [&](int first, int end) {
    for (int y = first; y < end; ++y) {
      const std::uint8_t *const gray = from.row(y), *const mean =
                                                        means_[static_cast<std::size_t>(current)].row(y) + kBlockPad;
      std::uint8_t* const row = to.row(y);
      for (int x = 0; x < w; ++x)
        row[kBlockPad + x] = static_cast<std::uint8_t>(std::clamp(gray[x] - mean[x] + 128, 0, 255));
      std::memset(row, row[kBlockPad], kBlockPad);
      std::memset(row + kBlockPad + w, row[kBlockPad + w - 1], 2 * kBlockPad);
    }
  });
}

void BlockMatcher::match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right, DisparityRange range,
                         const Matches& to) {
  resize(left.size());
  range_ = range;
  prepare(left, left_);
  prepare(right, right_);
  const int count = (size_.height + kStripRows - 1) / kStripRows, threads = std::min(count, workers_.threads());
  if (static_cast<int>(strips_.size()) < threads) strips_.resize(static_cast<std::size_t>(threads));
  workers_.parallel_for_parts(count, [&](int i, int worker) {
    match_strip({i * kStripRows, std::min(size_.height, (i + 1) * kStripRows)},
                strips_[static_cast<std::size_t>(worker)], to);
  });
}

std::size_t BlockMatcher::StripBuffers::bytes() const {
  return bytes_of(costs) + bytes_of(smoothed) + bytes_of(best) + bytes_of(before) + bytes_of(after) +
         bytes_of(previous) + bytes_of(right_best) + bytes_of(index) + bytes_of(right_index);
}

std::size_t BlockMatcher::buffer_bytes() const {
  std::size_t total = bytes_of(left_) + bytes_of(right_) + bytes_of(means_[0]) + bytes_of(means_[1]);
  for (const StripBuffers& strip : strips_) total += strip.bytes();
  return total;
}

std::int64_t BlockMatcher::memory_bytes(ImageSize size, int threads) {
  const std::int64_t wide = size.width + 4 * kBlockPad;
  return 4 * wide * size.height + threads * wide * (2 * (kStripRows + 2 * kRadius) + (5 + 4) * kStripRows);
}

}  // namespace spartan::internal::matching
