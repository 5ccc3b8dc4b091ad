#include "spartan/reconstruction/internal/matching/coarse_to_fine_matcher.h"

#include <algorithm>
#include <cmath>

#include "spartan/core/stage_clock.h"
#include "spartan/numerics/simd_target.h"
#include "spartan/reconstruction/internal/matching/image_bytes.h"

namespace spartan::internal::matching {
namespace {

Penalties penalties_of(const DisparityOptions& o) {
  Penalties p;
  p.p1 = static_cast<std::uint8_t>(o.p1);
  p.out_of_view = static_cast<std::uint8_t>(o.out_of_view_cost);
  for (std::size_t bin = 0; bin < p.p2.size(); ++bin) {
    const double change = kP2Bin * (static_cast<double>(bin) + 0.5) - 0.5;  // the middle of the bin
    p.p2[bin] = static_cast<std::uint8_t>(
        std::lround(std::max<double>(o.p2_edge, o.p2_flat / (1 + change / o.p2_falloff_levels))));
  }
  return p;
}

ImageSize halved(ImageSize size) {
  return {(size.width + 1) / 2, (size.height + 1) / 2};
}

// Means of 2×2 pixels; the last column and row of an odd size are repeated.
void halve(ImageView<const std::uint8_t> in, const ThreadPool& workers, Image<std::uint8_t>& out) {
  const ImageSize size = halved(in.size());
  if (out.size() != size) out = Image<std::uint8_t>(size);
  workers.parallel_for(0, size.height, 64, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      const std::uint8_t* const above = in.row(2 * y);
      const std::uint8_t* const below = in.row(std::min(2 * y + 1, in.height() - 1));
      std::uint8_t* const row = out.row(y);
      const int whole = in.width() / 2;
      for (int x = 0; x < whole; ++x) {
        const int sum = above[2 * x] + above[2 * x + 1] + below[2 * x] + below[2 * x + 1];
        row[x] = static_cast<std::uint8_t>((sum + 2) >> 2);
      }
      if (whole < size.width) row[whole] = static_cast<std::uint8_t>((above[2 * whole] + below[2 * whole] + 1) >> 1);
    }
  });
}

// The range at half of the resolution, within what an image of this width can hold.
DisparityRange halved(DisparityRange range, int width) {
  const auto half = [](int d, bool up) { return static_cast<int>(up ? std::ceil(0.5 * d) : std::floor(0.5 * d)); };
  return {std::clamp(half(range.min, false), 1 - width, width - 1),
          std::clamp(half(range.max, true), 1 - width, width - 1)};
}

}  // namespace

CoarseToFineMatcher::CoarseToFineMatcher(const DisparityOptions& options, const ThreadPool& workers)
    : CoarseToFineMatcher(penalties_of(options), simd_target_index(options.simd), workers) {}

CoarseToFineMatcher::CoarseToFineMatcher(const Penalties& penalties, std::size_t simd, const ThreadPool& workers)
    : workers_(workers),
      base_(penalties, kernels_for(simd), full_range_kernels_for(simd), workers),
      half_matcher_(penalties, kernels_for(simd), workers),
      full_matcher_(penalties, kernels_for(simd), workers) {}

void CoarseToFineMatcher::match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                DisparityRange range, const Matches& to) {
  Stopwatch watch;
  halve(left, workers_, half_.left);
  halve(right, workers_, half_.right);
  halve(half_.left, workers_, quarter_.left);
  halve(half_.right, workers_, quarter_.right);
  const DisparityRange half_range = halved(range, half_.left.width());
  const DisparityRange quarter_range = halved(half_range, quarter_.left.width());
  const ImageView<const float> base = base_.match(quarter_.left, quarter_.right, quarter_range, strips_);
  const auto half_tiles = choose_intervals(base, half_.left.size(), half_range, workers_);
  if (half_disparity_.size() != half_.left.size()) half_disparity_ = Image<float>(half_.left.size());
  half_matcher_.match(half_.left, half_.right, half_tiles, half_range, strips_, {half_disparity_, {}});
  const auto tiles = choose_intervals(half_disparity_, left.size(), range, workers_);
  coarse_ms_ = watch.lap();
  full_matcher_.match(left, right, tiles, range, strips_, to);
}

std::int64_t CoarseToFineMatcher::memory_bytes(ImageSize size, DisparityRange range, int threads) {
  const ImageSize half = halved(size), quarter = halved(half);
  const DisparityRange half_range = halved(range, half.width), quarter_range = halved(half_range, quarter.width);
  const auto pixels = [](ImageSize s) { return std::int64_t{s.width + 64} * s.height; };
  const std::int64_t strips = std::max(IntervalMatcher::strip_bytes(size, range, threads),
                                       FullRangeMatcher::strip_bytes(quarter, quarter_range, threads));
  return strips + IntervalMatcher::memory_bytes(size, range) + IntervalMatcher::memory_bytes(half, half_range) +
         FullRangeMatcher::memory_bytes(quarter, quarter_range) + 6 * pixels(half) + 2 * pixels(quarter);
}

std::size_t CoarseToFineMatcher::buffer_bytes() const {
  std::size_t total =
      base_.buffer_bytes() + half_matcher_.buffer_bytes() + full_matcher_.buffer_bytes() + bytes_of(half_disparity_);
  for (const StripBuffers& strip : strips_) total += strip.bytes();
  for (const Halved* pair : {&half_, &quarter_}) total += bytes_of(pair->left) + bytes_of(pair->right);
  return total;
}

}  // namespace spartan::internal::matching
