#include "spartan/odometry/internal/reconstruction/row_correlation.h"

#include <algorithm>
#include <array>
#include <cstring>

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/odometry/internal/reconstruction/row_correlation.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef SPARTAN_CORRELATION_BLOCK
#define SPARTAN_CORRELATION_BLOCK
namespace spartan::internal {
namespace {

constexpr int kColumns = 2 * kCorrelationRadiusX + 1, kRows = 2 * kCorrelationRadiusY + 1;
constexpr int kArea = kColumns * kRows;
/// Places that are correlated together, and the columns that their windows cover, in whole vectors.
constexpr int kBlock = 64, kBlockColumns = 96;
/// Rows in pairs; the last one is alone.
constexpr int kRowPairs = (kRows + 1) / 2;

/// The window that is sought, as pairs of pixels one above the other, and its sums.
struct SoughtWindow {
  std::array<std::array<std::int16_t, 2 * kColumns>, kRowPairs> pairs{};
  std::int32_t sum = 0, variance = 0;  // variance: of the sums, kArea² times that of a pixel
};

/// The columns of a block of windows in the other image.
struct CorrelationBlock {
  alignas(64) std::uint8_t rows[kRows + 1][kBlockColumns];  // the last row holds 0
  alignas(64) float correlation[kBlock];
};

}  // namespace
}  // namespace spartan::internal
#endif

HWY_BEFORE_NAMESPACE();
namespace spartan::internal::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Lanes = hn::CappedTag<std::int32_t, 16>;

/// Sums over the columns of each window.
HWY_INLINE hn::Vec<Lanes> window_sum(const std::int32_t* columns) {
  const Lanes d;
  auto sum = hn::LoadU(d, columns);
  for (int i = 1; i < kColumns; ++i) sum = hn::Add(sum, hn::LoadU(d, columns + i));
  return sum;
}

void correlate_block(const SoughtWindow& sought, CorrelationBlock& block) {
  const Lanes d;
  const hn::Rebind<std::uint8_t, Lanes> bytes;
  [[maybe_unused]] const hn::Repartition<std::int16_t, Lanes> halves;
  const hn::RebindToFloat<Lanes> floats;
  const int lanes = static_cast<int>(hn::Lanes(d));
  HWY_ALIGN std::int32_t sums[kBlockColumns + 16] = {}, squares[kBlockColumns + 16] = {};
  HWY_ALIGN std::int32_t pairs[kRowPairs][kBlockColumns + 16] = {};
  for (int x = 0; x < kBlockColumns; x += lanes) {
    auto sum = hn::Zero(d), square = hn::Zero(d);
    for (int p = 0; p < kRowPairs; ++p) {
      const auto upper = hn::PromoteTo(d, hn::LoadU(bytes, block.rows[2 * p] + x)),
                 lower = hn::PromoteTo(d, hn::LoadU(bytes, block.rows[2 * p + 1] + x));
      sum = hn::Add(sum, hn::Add(upper, lower));
      square = hn::Add(square, hn::Add(hn::Mul(upper, upper), hn::Mul(lower, lower)));
      hn::Store(hn::Or(upper, hn::ShiftLeft<16>(lower)), d, pairs[p] + x);
    }
    hn::Store(sum, d, sums + x);
    hn::Store(square, d, squares + x);
  }
  const auto area = hn::Set(d, kArea);
  // A standard deviation below half a gray level is quantization noise.
  const auto least = hn::Set(d, kArea * kArea / 4);
  for (int x = 0; x < kBlock; x += lanes) {
    auto product = hn::Zero(d);
    for (int p = 0; p < kRowPairs; ++p) {
      for (int i = 0; i < kColumns; ++i) {
        const auto values = hn::LoadU(d, pairs[p] + x + i);
        std::int32_t both;
        std::memcpy(&both, &sought.pairs[static_cast<std::size_t>(p)][static_cast<std::size_t>(2 * i)], sizeof(both));
        const auto weights = hn::Set(d, both);
        // Elsewhere the instruction leaves a part of the sums in its second accumulator.
#if HWY_ARCH_X86 && HWY_TARGET != HWY_SCALAR && HWY_TARGET != HWY_EMU128
        auto unused = hn::Zero(d);
        product = hn::ReorderWidenMulAccumulate(d, hn::BitCast(halves, values), hn::BitCast(halves, weights), product,
                                                unused);
#else
        const auto low = hn::Set(d, 0xFFFF);
        product = hn::Add(product, hn::Add(hn::Mul(hn::And(values, low), hn::And(weights, low)),
                                           hn::Mul(hn::ShiftRight<16>(values), hn::ShiftRight<16>(weights))));
#endif
      }
    }
    const auto sum = window_sum(sums + x), square = window_sum(squares + x);
    const auto variance = hn::Sub(hn::Mul(area, square), hn::Mul(sum, sum));
    const auto covariance = hn::Sub(hn::Mul(area, product), hn::Mul(hn::Set(d, sought.sum), sum));
    const auto scale = hn::Mul(hn::Sqrt(hn::ConvertTo(floats, hn::Max(variance, least))),
                               hn::Sqrt(hn::Set(floats, static_cast<float>(sought.variance))));
    const auto correlation = hn::Div(hn::ConvertTo(floats, covariance), scale);
    hn::Store(hn::IfThenElse(hn::RebindMask(floats, hn::Gt(variance, least)), correlation, hn::Set(floats, -1.0f)),
              floats, block.correlation + x);
  }
}

}  // namespace spartan::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::internal {
namespace {

HWY_EXPORT(correlate_block);

SoughtWindow sought_window(ImageView<const std::uint8_t> image, int x, int y) {
  SoughtWindow window;
  std::int32_t square = 0;
  for (int j = 0; j < kRows; ++j) {
    const std::uint8_t* const row = image.row(y + j - kCorrelationRadiusY) + x - kCorrelationRadiusX;
    for (int i = 0; i < kColumns; ++i) {
      window.pairs[static_cast<std::size_t>(j / 2)][static_cast<std::size_t>(2 * i + j % 2)] = row[i];
      window.sum += row[i];
      square += row[i] * row[i];
    }
  }
  window.variance = kArea * square - window.sum * window.sum;
  return window;
}

}  // namespace

std::vector<float> correlate_row(ImageView<const std::uint8_t> image, int x, int y, ImageView<const std::uint8_t> other,
                                 int from, int to) {
  const int count = to - from + 1;
  std::vector<float> correlation(static_cast<std::size_t>(count), -1.0f);
  const SoughtWindow window = sought_window(image, x, y);
  if (4 * window.variance <= kArea * kArea) return correlation;
  CorrelationBlock block{};
  for (int begin = 0; begin < count; begin += kBlock) {
    const int places = std::min(kBlock, count - begin), columns = places + kColumns - 1;
    for (int j = 0; j < kRows; ++j) {
      std::copy_n(other.row(y + j - kCorrelationRadiusY) + from + begin - kCorrelationRadiusX, columns, block.rows[j]);
    }
    HWY_DYNAMIC_DISPATCH(correlate_block)(window, block);
    std::copy_n(block.correlation, places, correlation.begin() + begin);
  }
  return correlation;
}

}  // namespace spartan::internal
#endif  // HWY_ONCE
