#include "spartan/odometry/internal/matching/window_kernels.h"

#include <algorithm>
#include <cmath>
#include <cstring>

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/odometry/internal/matching/window_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spartan::internal::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kWindowStride>;
using Integers = hn::RebindToSigned<Floats>;
using Values = hn::Vec<Floats>;

constexpr float kLevel = 1.0f / 256.0f;

/// Pairs of neighbouring pixels, the left one in the low half.
HWY_INLINE hn::Vec<Integers> gather_pairs(Integers d, const std::uint16_t* pixels, hn::Vec<Integers> index) {
#if HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2
  return hn::GatherOffset(d, reinterpret_cast<const std::int32_t*>(pixels), hn::Add(index, index));
#else
  HWY_ALIGN std::int32_t at[kWindowStride], pairs[kWindowStride];
  hn::Store(index, d, at);
  for (std::size_t i = 0; i < hn::Lanes(d); ++i) std::memcpy(&pairs[i], pixels + at[i], sizeof(std::int32_t));
  return hn::Load(d, pairs);
#endif
}

/// Neighbouring pixels of an image row as pairs: from a pixel on, as many as two vectors hold.
struct PairTable {
  hn::Vec<Integers> even, odd;  // pairs that begin with pixel 0, 2, … and 1, 3, …

  HWY_INLINE explicit PairTable(const std::uint16_t* pixels) {
    const Integers d;
    even = hn::LoadU(d, reinterpret_cast<const std::int32_t*>(pixels));
    odd = hn::LoadU(d, reinterpret_cast<const std::int32_t*>(pixels + 1));
  }
  HWY_INLINE hn::Vec<Integers> at(hn::Vec<Integers> pixel) const {
    const Integers d;
    const auto half = hn::IndicesFromVec(d, hn::ShiftRight<1>(pixel));
    const auto is_odd = hn::TestBit(pixel, hn::Set(d, 1));
    return hn::IfThenElse(is_odd, hn::TableLookupLanes(odd, half), hn::TableLookupLanes(even, half));
  }
};

/// ⌊x⌋ and the rest of x, 0 ≤ x < 2²³: cheaper than ConvertTo(), which handles larger values too.
struct Split {
  hn::Vec<Integers> whole;
  Values rest;

  HWY_INLINE explicit Split(Values x) {
    const Floats d;
    const Integers integers;
    // The low bits of 2²³ + n are those of n.
    const auto floor = hn::Floor(x), bias = hn::Set(d, 8388608.0f);
    rest = hn::Sub(x, floor);
    whole = hn::Xor(hn::BitCast(integers, hn::Add(floor, bias)), hn::BitCast(integers, bias));
  }
};

/// The pairs of pixels above and below each place.
struct Lines {
  hn::Vec<Integers> top, bottom;
};

/// Interpolates one row of a window or of a patch, less `level`: columns `first` to `first` + lanes, of which those
/// behind the last repeat it. Where `kAlongRow`, rows of the window are rows of the image (yx = 0).
template <bool kAlongRow>
class RowSampler {
 public:
  HWY_INLINE RowSampler(const WindowPlace& p, float level, int radius, int first)
      : place_(p),
        level_(level),
        stride_(static_cast<std::int32_t>(p.image.stride())),
        has_tables_(kTables && p.image.width() > kTablePixels && p.image.height() >= 3) {
    const Floats d;
    const auto column =
        hn::Sub(hn::Min(hn::Iota(d, static_cast<float>(first)), hn::Set(d, static_cast<float>(2 * radius))),
                hn::Set(d, static_cast<float>(radius)));
    from_x_ = hn::MulAdd(column, hn::Set(d, p.xx), hn::Set(d, p.x));
    from_y_ = hn::MulAdd(column, hn::Set(d, p.yx), hn::Set(d, p.y));
  }

  HWY_INLINE Values row(int offset) const {
    const Floats d;
    const Split x(hn::Add(from_x_, hn::Set(d, place_.xy * static_cast<float>(offset))));
    if constexpr (kAlongRow) {
      const float y = place_.y + place_.yy * static_cast<float>(offset);
      const int line = static_cast<int>(y);
      return interpolate(lines_at(x.whole, line), x.rest, hn::Set(d, y - static_cast<float>(line)));
    } else {
      const Split y(hn::Add(from_y_, hn::Set(d, place_.yy * static_cast<float>(offset))));
      return interpolate(lines_at(x.whole, y.whole), x.rest, y.rest);
    }
  }

 private:
  /// Gathering is slower than looking up in vectors, where they look up by lanes of 32 bits.
  static constexpr bool kTables = HWY_ARCH_X86 && HWY_TARGET <= HWY_AVX2;
  static constexpr int kTablePixels = 2 * static_cast<int>(hn::MaxLanes(Integers()));

  /// Where the table begins that holds the places `ix`, if they are few enough.
  HWY_INLINE int table_column(hn::Vec<Integers> ix) const {
    return std::min(hn::GetLane(ix), place_.image.width() - kTablePixels - 1);
  }

  HWY_INLINE Lines lines_at(hn::Vec<Integers> ix, int line) const {
    const Integers d;
    if (has_tables_) {
      const int column = table_column(ix);
      const auto right = hn::Sub(ix, hn::Set(d, column));
      if (hn::AllTrue(d, hn::Eq(hn::AndNot(hn::Set(d, kTablePixels - 1), right), hn::Zero(d)))) {
        const std::uint16_t* const pixels = place_.image.row(line) + column;
        return {PairTable(pixels).at(right), PairTable(pixels + stride_).at(right)};
      }
    }
    return gather_lines(ix, hn::Set(d, line));
  }

  HWY_INLINE Lines lines_at(hn::Vec<Integers> ix, hn::Vec<Integers> iy) const {
    const Integers d;
    if (has_tables_) {
      const int column = table_column(ix);
      const int line = std::clamp(hn::GetLane(iy) - (place_.yx < 0 ? 1 : 0), 0, place_.image.height() - 3);
      const auto right = hn::Sub(ix, hn::Set(d, column)), down = hn::Sub(iy, hn::Set(d, line));
      const auto outside = hn::Or(hn::AndNot(hn::Set(d, kTablePixels - 1), right), hn::AndNot(hn::Set(d, 1), down));
      if (hn::AllTrue(d, hn::Eq(outside, hn::Zero(d)))) {
        const std::uint16_t* const pixels = place_.image.row(line) + column;
        const auto first = PairTable(pixels).at(right), second = PairTable(pixels + stride_).at(right),
                   third = PairTable(pixels + 2 * stride_).at(right);
        const auto upper = hn::Eq(down, hn::Zero(d));
        return {hn::IfThenElse(upper, first, second), hn::IfThenElse(upper, second, third)};
      }
    }
    return gather_lines(ix, iy);
  }

  HWY_INLINE Lines gather_lines(hn::Vec<Integers> ix, hn::Vec<Integers> iy) const {
    const Integers d;
    const std::uint16_t* const pixels = place_.image.row(0);
    const auto index = hn::Add(hn::Mul(iy, hn::Set(d, stride_)), ix);
    return {gather_pairs(d, pixels, index), gather_pairs(d, pixels, hn::Add(index, hn::Set(d, stride_)))};
  }

  HWY_INLINE Values interpolate(const Lines& lines, Values fx, Values fy) const {
    const Floats d;
    const auto top = between(lines.top, fx), bottom = between(lines.bottom, fx);
    return hn::MulSub(hn::MulAdd(fy, hn::Sub(bottom, top), top), hn::Set(d, kLevel), hn::Set(d, level_));
  }

  HWY_INLINE Values between(hn::Vec<Integers> pairs, Values fraction) const {
    const Floats d;
    const Integers integers;
    const hn::RebindToUnsigned<Integers> bits;
    const auto left = hn::ConvertTo(d, hn::And(pairs, hn::Set(integers, 0xFFFF)));
    const auto right = hn::ConvertTo(d, hn::BitCast(integers, hn::ShiftRight<16>(hn::BitCast(bits, pairs))));
    return hn::MulAdd(fraction, hn::Sub(right, left), left);
  }

  const WindowPlace& place_;
  float level_;
  Values from_x_, from_y_;
  std::int32_t stride_;
  bool has_tables_;  // the image is large enough for them
};

template <bool kAlongRow, int kCount>
HWY_INLINE WindowSums sums_with(const WindowPlace& place, float level, const Window* factors) {
  const Floats d;
  WindowSums sums;
  const float* const weights = window_weights().values.data();
  for (int first = 0; first < kWindowStride; first += static_cast<int>(hn::Lanes(d))) {
    const RowSampler<kAlongRow> sampler(place, level, kWindowRadius, first);
    auto mean = hn::Zero(d), square = hn::Zero(d);
    Values products[kCount];
    for (int k = 0; k < kCount; ++k) products[k] = hn::Zero(d);
    for (int row = 0; row < kWindowSide; ++row) {
      const auto value = sampler.row(row - kWindowRadius);
      const std::size_t at = static_cast<std::size_t>(row * kWindowStride + first);
      const auto weight = hn::Mul(hn::Load(d, weights + at), value);
      mean = hn::Add(mean, weight);
      square = hn::MulAdd(weight, value, square);
      for (int k = 0; k < kCount; ++k)
        products[k] = hn::MulAdd(hn::Load(d, factors[k].values.data() + at), value, products[k]);
    }
    sums.mean += hn::GetLane(hn::SumOfLanes(d, mean));
    sums.square += hn::GetLane(hn::SumOfLanes(d, square));
    for (int k = 0; k < kCount; ++k)
      sums.products[static_cast<std::size_t>(k)] += hn::GetLane(hn::SumOfLanes(d, products[k]));
  }
  return sums;
}

template <bool kAlongRow>
HWY_INLINE WindowSums sums_of(const WindowPlace& place, float level, const Window* factors, int count) {
  static_assert(kMinFactors == 3 && kMaxFactors == 5);
  if (count == 3) return sums_with<kAlongRow, 3>(place, level, factors);
  if (count == 4) return sums_with<kAlongRow, 4>(place, level, factors);
  return sums_with<kAlongRow, 5>(place, level, factors);
}

WindowSums sums(const WindowPlace& place, float level, const Window* factors, int count) {
  if (place.yx == 0) return sums_of<true>(place, level, factors, count);
  return sums_of<false>(place, level, factors, count);
}

/// Stores values and half the differences of their neighbours; 0 behind the window.
HWY_INLINE void store_gradients(WindowGradients& g, int row, int first, Values value, Values along_x, Values along_y) {
  const Floats d;
  const std::size_t at = static_cast<std::size_t>(row * kWindowStride + first);
  const auto inside = hn::Lt(hn::Iota(d, static_cast<float>(first)), hn::Set(d, static_cast<float>(kWindowSide)));
  const auto half = hn::Set(d, 0.5f);
  hn::Store(hn::IfThenElseZero(inside, value), d, g.value.values.data() + at);
  hn::Store(hn::IfThenElseZero(inside, hn::Mul(half, along_x)), d, g.along_x.values.data() + at);
  hn::Store(hn::IfThenElseZero(inside, hn::Mul(half, along_y)), d, g.along_y.values.data() + at);
}

WindowGradients gradients(ImageView<const std::uint16_t> image, float x, float y) {
  const Floats d;
  const WindowPlace place{image, x, y};
  // Two columns more than a row, which the differences along x read.
  constexpr int kRow = kWindowStride + static_cast<int>(hn::MaxLanes(Floats()));
  HWY_ALIGN float patch[kPatchSide * kRow];
  for (int first = 0; first < kWindowStride; first += static_cast<int>(hn::Lanes(d))) {
    const RowSampler<true> sampler(place, 0, kWindowRadius + 1, first);
    for (int row = 0; row < kPatchSide; ++row) {
      const auto value = sampler.row(row - kWindowRadius - 1);
      hn::StoreU(value, d, patch + row * kRow + first);
      // Defined values behind the row, for the last columns, which have no weight.
      hn::StoreU(value, d, patch + row * kRow + kWindowStride);
    }
  }
  WindowGradients g;
  for (int row = 0; row < kWindowSide; ++row) {
    for (int first = 0; first < kWindowStride; first += static_cast<int>(hn::Lanes(d))) {
      const float* const p = patch + (row + 1) * kRow + first + 1;
      store_gradients(g, row, first, hn::LoadU(d, p), hn::Sub(hn::LoadU(d, p + 1), hn::LoadU(d, p - 1)),
                      hn::Sub(hn::LoadU(d, p + kRow), hn::LoadU(d, p - kRow)));
    }
  }
  return g;
}

WindowGradients gradients_of_patch(const std::uint16_t* patch) {
  const Floats d;
  const Integers integers;
  const hn::Rebind<std::uint16_t, Floats> narrow;
  const auto at = [&](const std::uint16_t* pixels) HWY_ATTR {
    return hn::Mul(hn::ConvertTo(d, hn::PromoteTo(integers, hn::LoadU(narrow, pixels))), hn::Set(d, kLevel));
  };
  WindowGradients g;
  for (int row = 0; row < kWindowSide; ++row) {
    for (int first = 0; first < kWindowStride; first += static_cast<int>(hn::Lanes(d))) {
      const std::uint16_t* const p = patch + (row + 1) * kWindowStride + first + 1;
      store_gradients(g, row, first, at(p), hn::Sub(at(p + 1), at(p - 1)),
                      hn::Sub(at(p + kWindowStride), at(p - kWindowStride)));
    }
  }
  return g;
}

WindowStatistics without_mean(Window& window) {
  const Floats d;
  const float* const weights = window_weights().values.data();
  float* const values = window.values.data();
  WindowStatistics statistics;
  auto sum = hn::Zero(d), squares = hn::Zero(d);
  for (std::size_t i = 0; i < window.values.size(); i += hn::Lanes(d))
    sum = hn::MulAdd(hn::Load(d, weights + i), hn::Load(d, values + i), sum);
  statistics.mean = hn::GetLane(hn::SumOfLanes(d, sum));
  const auto mean = hn::Set(d, statistics.mean);
  for (std::size_t i = 0; i < window.values.size(); i += hn::Lanes(d)) {
    const auto weight = hn::Load(d, weights + i);
    const auto value = hn::IfThenElseZero(hn::Gt(weight, hn::Zero(d)), hn::Sub(hn::Load(d, values + i), mean));
    hn::Store(value, d, values + i);
    squares = hn::MulAdd(hn::Mul(weight, value), value, squares);
  }
  statistics.variance = hn::GetLane(hn::SumOfLanes(d, squares));
  return statistics;
}

}  // namespace spartan::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::internal {

const Window& window_weights() {
  static const Window weights = [] {
    constexpr float kSigma_px = 4.0f;
    Window w;
    float sum = 0;
    for (int y = 0; y < kWindowSide; ++y) {
      for (int x = 0; x < kWindowSide; ++x) {
        const int dx = x - kWindowRadius, dy = y - kWindowRadius;
        float& weight = w.values[static_cast<std::size_t>(y * kWindowStride + x)];
        weight = std::exp(-static_cast<float>(dx * dx + dy * dy) / (2 * kSigma_px * kSigma_px));
        sum += weight;
      }
    }
    for (float& value : w.values) value /= sum;
    return w;
  }();
  return weights;
}

HWY_EXPORT(sums);
HWY_EXPORT(gradients);
HWY_EXPORT(gradients_of_patch);
HWY_EXPORT(without_mean);

WindowSums window_sums(const WindowPlace& place, float level, const Window* factors, int count) {
  return HWY_DYNAMIC_DISPATCH(sums)(place, level, factors, count);
}

WindowGradients window_gradients(ImageView<const std::uint16_t> image, float x, float y) {
  return HWY_DYNAMIC_DISPATCH(gradients)(image, x, y);
}

WindowGradients patch_gradients(const std::uint16_t* patch) {
  return HWY_DYNAMIC_DISPATCH(gradients_of_patch)(patch);
}

WindowStatistics subtract_mean(Window& window) {
  return HWY_DYNAMIC_DISPATCH(without_mean)(window);
}

}  // namespace spartan::internal
#endif  // HWY_ONCE
