#include "spartan/odometry/internal/matching/window_kernels.h"

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

/// Interpolates one row of a window or of a patch: columns `first` to `first` + lanes, of which those behind `last`
/// repeat it.
struct RowSampler {
  const Floats d;
  const WindowPlace& place;
  Values from_x, from_y;
  std::int32_t stride;

  HWY_INLINE RowSampler(const WindowPlace& p, int radius, int first)
      : place(p), stride(static_cast<std::int32_t>(p.image.stride())) {
    const auto column =
        hn::Sub(hn::Min(hn::Iota(d, static_cast<float>(first)), hn::Set(d, static_cast<float>(2 * radius))),
                hn::Set(d, static_cast<float>(radius)));
    from_x = hn::MulAdd(column, hn::Set(d, p.xx), hn::Set(d, p.x));
    from_y = hn::MulAdd(column, hn::Set(d, p.yx), hn::Set(d, p.y));
  }

  HWY_INLINE Values row(int offset) const {
    const Integers integers;
    const auto x = hn::Add(from_x, hn::Set(d, place.xy * static_cast<float>(offset))),
               y = hn::Add(from_y, hn::Set(d, place.yy * static_cast<float>(offset)));
    const auto ix = hn::ConvertTo(integers, x), iy = hn::ConvertTo(integers, y);
    const auto fx = hn::Sub(x, hn::ConvertTo(d, ix)), fy = hn::Sub(y, hn::ConvertTo(d, iy));
    const auto index = hn::Add(hn::Mul(iy, hn::Set(integers, stride)), ix);
    const auto top = interpolate(gather_pairs(integers, place.image.row(0), index), fx);
    const auto bottom =
        interpolate(gather_pairs(integers, place.image.row(0), hn::Add(index, hn::Set(integers, stride))), fx);
    return hn::Mul(hn::MulAdd(fy, hn::Sub(bottom, top), top), hn::Set(d, kLevel));
  }

 private:
  HWY_INLINE Values interpolate(hn::Vec<Integers> pairs, Values fraction) const {
    const Integers integers;
    const hn::RebindToUnsigned<Integers> bits;
    const auto left = hn::ConvertTo(d, hn::And(pairs, hn::Set(integers, 0xFFFF)));
    const auto right = hn::ConvertTo(d, hn::BitCast(integers, hn::ShiftRight<16>(hn::BitCast(bits, pairs))));
    return hn::MulAdd(fraction, hn::Sub(right, left), left);
  }
};

template <int kCount>
HWY_INLINE WindowSums sums_with(const WindowPlace& place, float level, const Window* factors) {
  const Floats d;
  WindowSums sums;
  const float* const weights = window_weights().values.data();
  for (int first = 0; first < kWindowStride; first += static_cast<int>(hn::Lanes(d))) {
    const RowSampler sampler(place, kWindowRadius, first);
    auto mean = hn::Zero(d), square = hn::Zero(d);
    Values products[kCount];
    for (int k = 0; k < kCount; ++k) products[k] = hn::Zero(d);
    for (int row = 0; row < kWindowSide; ++row) {
      const auto value = hn::Sub(sampler.row(row - kWindowRadius), hn::Set(d, level));
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

WindowSums sums(const WindowPlace& place, float level, const Window* factors, int count) {
  static_assert(kMinFactors == 3 && kMaxFactors == 5);
  if (count == 3) return sums_with<3>(place, level, factors);
  if (count == 4) return sums_with<4>(place, level, factors);
  return sums_with<5>(place, level, factors);
}

WindowGradients gradients(const WindowPlace& place) {
  const Floats d;
  // Two columns more than a row, which the differences along x read.
  constexpr int kRow = kWindowStride + static_cast<int>(hn::MaxLanes(Floats()));
  HWY_ALIGN float patch[kPatchSide * kRow];
  for (int first = 0; first < kWindowStride; first += static_cast<int>(hn::Lanes(d))) {
    const RowSampler sampler(place, kWindowRadius + 1, first);
    for (int row = 0; row < kPatchSide; ++row) {
      const auto value = sampler.row(row - kWindowRadius - 1);
      hn::StoreU(value, d, patch + row * kRow + first);
      // Defined values behind the row, for the last columns, which have no weight.
      hn::StoreU(value, d, patch + row * kRow + kWindowStride);
    }
  }
  WindowGradients g;
  const auto half = hn::Set(d, 0.5f);
  for (int row = 0; row < kWindowSide; ++row) {
    for (int first = 0; first < kWindowStride; first += static_cast<int>(hn::Lanes(d))) {
      const float* const p = patch + (row + 1) * kRow + first + 1;
      const std::size_t at = static_cast<std::size_t>(row * kWindowStride + first);
      const auto inside = hn::Lt(hn::Iota(d, static_cast<float>(first)), hn::Set(d, static_cast<float>(kWindowSide)));
      hn::Store(hn::IfThenElseZero(inside, hn::LoadU(d, p)), d, g.value.values.data() + at);
      hn::Store(hn::IfThenElseZero(inside, hn::Mul(half, hn::Sub(hn::LoadU(d, p + 1), hn::LoadU(d, p - 1)))), d,
                g.along_x.values.data() + at);
      hn::Store(hn::IfThenElseZero(inside, hn::Mul(half, hn::Sub(hn::LoadU(d, p + kRow), hn::LoadU(d, p - kRow)))), d,
                g.along_y.values.data() + at);
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
HWY_EXPORT(without_mean);

WindowSums window_sums(const WindowPlace& place, float level, const Window* factors, int count) {
  return HWY_DYNAMIC_DISPATCH(sums)(place, level, factors, count);
}

WindowGradients window_gradients(const WindowPlace& place) {
  return HWY_DYNAMIC_DISPATCH(gradients)(place);
}

WindowStatistics subtract_mean(Window& window) {
  return HWY_DYNAMIC_DISPATCH(without_mean)(window);
}

}  // namespace spartan::internal
#endif  // HWY_ONCE
