#include "spartan/imaging/internal/debayer_kernels.h"

#include <algorithm>
#include <cstdlib>

#include "spartan/imaging/internal/mirrored.h"
#include "spartan/numerics/luma.h"

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/imaging/internal/debayer_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spartan::internal::bayer::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kChunk = 256;  // columns per chunk, so that its colours fit on the stack

template <class T>
struct Colours {
  T r[kChunk], g[kChunk], b[kChunk];
};

template <class T>
void store(const Colours<T>& c, int count, Rgb<T>* out) {
  int i = 0;
#if HWY_TARGET != HWY_SCALAR
  const hn::CappedTag<T, 32> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (; i + lanes <= count; i += lanes) {
    hn::StoreInterleaved3(hn::LoadU(d, c.r + i), hn::LoadU(d, c.g + i), hn::LoadU(d, c.b + i), d, &out[i].r);
  }
#endif
  for (; i < count; ++i) out[i] = {c.r[i], c.g[i], c.b[i]};
}

template <class T>
void store(const Colours<T>& c, int count, T* out) {
  for (int i = 0; i < count; ++i) out[i] = luma(Rgb<T>{c.r[i], c.g[i], c.b[i]});
}

// --- bilinear ---

template <class T>
T mean(unsigned a, unsigned b) {
  return static_cast<T>((a + b + 1) / 2);
}
template <class T>
T mean(unsigned a, unsigned b, unsigned c, unsigned d) {
  return static_cast<T>((a + b + c + d + 2) / 4);
}

/// Interpolates columns begin … begin + count − 1, whose neighbours are `left` columns before and `right` columns
/// after.
template <class T>
HWY_INLINE void bilinear_chunk(const BilinearRow<T>& row, int begin, int count, int left, int right, Colours<T>& c) {
  const T *const above = row.above + begin, *const here = row.here + begin, *const below = row.below + begin;
  T* const own = row.red_row ? c.r : c.b;
  T* const other = row.red_row ? c.b : c.r;
  // Every other sample is green; the parity selects them without a branch.
  const unsigned first = (row.green_first ? 0U : 1U) ^ (static_cast<unsigned>(begin) & 1U);
  for (int i = 0; i < count; ++i) {
    const unsigned l = here[i - left], r = here[i + right], a = above[i], b = below[i];
    const bool green = ((static_cast<unsigned>(i) ^ first) & 1U) == 0;
    const T horizontal = mean<T>(l, r), vertical = mean<T>(a, b);
    const T cross = mean<T>(a, b, l, r);
    const T diagonal = mean<T>(above[i - left], above[i + right], below[i - left], below[i + right]);
    own[i] = green ? horizontal : here[i];
    c.g[i] = green ? here[i] : cross;
    other[i] = green ? vertical : diagonal;
  }
}

template <class T, class Pixel>
void bilinear_row(const BilinearRow<T>& row, Pixel* out) {
  Colours<T> colours;
  const int last = row.width - 1;
  bilinear_chunk(row, 0, 1, -1, 1, colours);
  store(colours, 1, out);
  for (int x = 1; x < last; x += kChunk) {
    const int count = std::min(kChunk, last - x);
    bilinear_chunk(row, x, count, 1, 1, colours);
    store(colours, count, out + x);
  }
  bilinear_chunk(row, last, 1, 1, -1, colours);
  store(colours, 1, out + last);
}

// --- edge-aware ---
// Rows hold values in 1/32 of a level. Row functions process columns −margin … width + margin − 1; `green` has all bits
// set where the sample of the mosaic is green.

using Row = std::int32_t*;
using ConstRow = const std::int32_t*;
constexpr int kUnitBits = 5, kUnit = 1 << kUnitBits;

template <class T>
void load(ImageView<const T> mosaic, int y, Row out) {
  const T* const in = mosaic.row(mirrored(y, mosaic.height()));
  const int width = mosaic.width();
  for (int x = 0; x < width; ++x) out[x] = kUnit * in[x];
  for (int i = 1; i <= BandBuffers::kMargin; ++i) {
    out[-i] = out[mirrored(-i, width)];
    out[width - 1 + i] = out[mirrored(width - 1 + i, width)];
  }
}

/// Green minus the other colour, with the missing one interpolated along the row (horizontal) and the column
/// (vertical): M̂ = ½ (M₋₁ + M₊₁) + 5/32 (2 M₀ − M₋₂ − M₊₂).
void differences(const ConstRow m[5], ConstRow green, int margin, int width, Row HWY_RESTRICT horizontal,
                 Row HWY_RESTRICT vertical) {
  for (int x = -margin; x < width + margin; ++x) {
    const int own = m[2][x];
    const int h = (16 * (m[2][x - 1] + m[2][x + 1]) + 5 * (2 * own - m[2][x - 2] - m[2][x + 2])) >> kUnitBits;
    const int v = (16 * (m[1][x] + m[3][x]) + 5 * (2 * own - m[0][x] - m[4][x])) >> kUnitBits;
    horizontal[x] = green[x] != 0 ? own - h : h - own;
    vertical[x] = green[x] != 0 ? own - v : v - own;
  }
}

void gradients(ConstRow before, ConstRow behind, int margin, int width, Row HWY_RESTRICT step) {
  for (int x = -margin; x < width + margin; ++x) step[x] = std::abs(before[x] - behind[x]);
}

void sums_3x3(const ConstRow rows[3], int margin, int width, Row HWY_RESTRICT sum) {
  for (int x = -margin; x < width + margin; ++x) {
    sum[x] = rows[0][x - 1] + rows[0][x] + rows[0][x + 1] + rows[1][x - 1] + rows[1][x] + rows[1][x + 1] +
             rows[2][x - 1] + rows[2][x] + rows[2][x + 1];
  }
}

/// Bitwise select: `chosen` where all bits of the mask are set, `other` where none is.
HWY_INLINE int select(int mask, int chosen, int other) {
  return other ^ ((other ^ chosen) & mask);
}

HWY_INLINE int rounded(float value) {
  return static_cast<int>(value + (value < 0 ? -0.5F : 0.5F));
}

struct GreenRows {
  ConstRow mosaic, horizontal, vertical[3], row_gradient_sum, sum_above, sum_below;
};

/// Green at red and blue samples: the sample plus the mean difference of the four sides, weighted by
/// 1 / (1 + sum of gradients)².
void greens(const GreenRows& r, ConstRow green, float scale, int largest, int margin, int width,
            Row HWY_RESTRICT green_out, Row HWY_RESTRICT difference) {
  const auto squared = [=](int sum) HWY_ATTR {
    const float s = static_cast<float>(sum) * scale + 1.0F;
    return s * s;
  };
  for (int x = -margin; x < width + margin; ++x) {
    const float north = squared(r.sum_above[x]), south = squared(r.sum_below[x]);
    const float west = squared(r.row_gradient_sum[x - 1]), east = squared(r.row_gradient_sum[x + 1]);
    // 1/a : 1/b : 1/c : 1/d = bcd : acd : abd : abc
    const float horizontal = west * east, vertical = north * south;
    const float weight_north = south * horizontal, weight_south = north * horizontal;
    const float weight_west = east * vertical, weight_east = west * vertical;
    const float total = (weight_north + weight_south) + (weight_west + weight_east);
    const float sum = (weight_north * static_cast<float>(r.vertical[1][x] + r.vertical[0][x]) +
                       weight_south * static_cast<float>(r.vertical[1][x] + r.vertical[2][x])) +
                      (weight_west * static_cast<float>(r.horizontal[x] + r.horizontal[x - 1]) +
                       weight_east * static_cast<float>(r.horizontal[x] + r.horizontal[x + 1]));
    const int own = r.mosaic[x];
    const int level = std::min(std::max(own + rounded(sum / (2 * total)), 0), largest);
    green_out[x] = select(green[x], own, level);
    difference[x] = level - own;
  }
}

/// Weighted mean of two pairs of opposite neighbours; the weight of a pair falls with the edge strength along its axis.
HWY_INLINE int blend_pairs(int a0, int a1, int b0, int b1, int edges_a, int edges_b, float scale) {
  const float weight_a = static_cast<float>(edges_b + std::abs(b0 - b1)) * scale + 1.0F;
  const float weight_b = static_cast<float>(edges_a + std::abs(a0 - a1)) * scale + 1.0F;
  const float sum = weight_a * static_cast<float>(a0 + a1) + weight_b * static_cast<float>(b0 + b1);
  return rounded(sum / (2 * (weight_a + weight_b)));
}

/// First plus second difference of green along an axis.
HWY_INLINE int edge_strength(int before, int here, int behind) {
  return std::abs(before - behind) + std::abs(2 * here - before - behind);
}

/// Green minus blue at red samples, or green minus red at blue samples: from the four diagonal neighbours.
void opposite_colour(const ConstRow green[3], const ConstRow difference[3], float scale, int margin, int width,
                     Row HWY_RESTRICT out) {
  for (int x = -margin; x < width + margin; ++x) {
    const int falling = edge_strength(green[0][x - 1], green[1][x], green[2][x + 1]);
    const int rising = edge_strength(green[0][x + 1], green[1][x], green[2][x - 1]);
    out[x] = blend_pairs(difference[0][x - 1], difference[2][x + 1], difference[0][x + 1], difference[2][x - 1],
                         falling, rising, scale);
  }
}

template <class T>
HWY_INLINE T level_of(int value, int largest) {
  return static_cast<T>((std::min(std::max(value, 0), largest) + kUnit / 2) >> kUnitBits);
}

struct ColourRows {
  ConstRow green[3], green_minus_red[3], green_minus_blue[3];
};

template <class T>
void colours(const ColourRows& rows, ConstRow green, float scale, int largest, int begin, int count,
             T* HWY_RESTRICT red_out, T* HWY_RESTRICT green_out, T* HWY_RESTRICT blue_out) {
  const ColourRows r = rows;
  for (int i = 0; i < count; ++i) {
    const int x = begin + i, own = r.green[1][x], own_red = r.green_minus_red[1][x],
              own_blue = r.green_minus_blue[1][x];
    const int vertical = edge_strength(r.green[0][x], own, r.green[2][x]);
    const int horizontal = edge_strength(r.green[1][x - 1], own, r.green[1][x + 1]);
    const int red = blend_pairs(r.green_minus_red[0][x], r.green_minus_red[2][x], r.green_minus_red[1][x - 1],
                                r.green_minus_red[1][x + 1], vertical, horizontal, scale);
    const int blue = blend_pairs(r.green_minus_blue[0][x], r.green_minus_blue[2][x], r.green_minus_blue[1][x - 1],
                                 r.green_minus_blue[1][x + 1], vertical, horizontal, scale);
    red_out[i] = level_of<T>(own - select(green[x], red, own_red), largest);
    green_out[i] = level_of<T>(own, largest);
    blue_out[i] = level_of<T>(own - select(green[x], blue, own_blue), largest);
  }
}

template <class T, class Pixel>
void edge_aware(const Band<T, Pixel>& band, BandBuffers& buffers) {
  using M = BandBuffers;
  const int width = band.mosaic.width();
  const int largest = kUnit * band.full_scale;
  // Gradients are in 8-bit levels at any bit depth: the result is then the same, and their products stay within the
  // range of a float. Full scales are one below a power of two, so `level` is the power of two that one 8-bit level
  // spans.
  const int level = band.full_scale / 256 + 1;
  const float scale = 1.0F / static_cast<float>(kUnit * level);
  const auto green = [&](int y) HWY_ATTR { return buffers.columns(band.phase.is_green(0, y)); };
  const auto row = [&](M::Plane plane, int y) HWY_ATTR { return buffers.row(plane, y); };
  // A pipeline over rows: each step lags the one before it by the number of rows that it needs below its own.
  for (int t = band.begin - 7; t < band.end + 7; ++t) {
    load(band.mosaic, t, row(M::mosaic, t));
    int y = t - 2;
    const ConstRow around[5] = {row(M::mosaic, y - 2), row(M::mosaic, y - 1), row(M::mosaic, y), row(M::mosaic, y + 1),
                                row(M::mosaic, y + 2)};
    differences(around, green(y), 6, width, row(M::horizontal, y), row(M::vertical, y));
    gradients(row(M::horizontal, y) - 1, row(M::horizontal, y) + 1, 5, width, row(M::row_gradient, y));
    y = t - 3;
    gradients(row(M::vertical, y - 1), row(M::vertical, y + 1), 5, width, row(M::column_gradient, y));
    y = t - 4;
    for (const auto& [step, sum] :
         {std::pair{M::row_gradient, M::row_gradient_sum}, {M::column_gradient, M::column_gradient_sum}}) {
      const ConstRow three[3] = {row(step, y - 1), row(step, y), row(step, y + 1)};
      sums_3x3(three, 4, width, row(sum, y));
    }
    y = t - 5;
    greens({row(M::mosaic, y),
            row(M::horizontal, y),
            {row(M::vertical, y - 1), row(M::vertical, y), row(M::vertical, y + 1)},
            row(M::row_gradient_sum, y),
            row(M::column_gradient_sum, y - 1),
            row(M::column_gradient_sum, y + 1)},
           green(y), scale, largest, 3, width, row(M::green, y), row(M::difference, y));
    y = t - 6;
    const ConstRow green_rows[3] = {row(M::green, y - 1), row(M::green, y), row(M::green, y + 1)};
    const ConstRow differences_around[3] = {row(M::difference, y - 1), row(M::difference, y),
                                            row(M::difference, y + 1)};
    const bool red_row = band.phase.is_red_row(y);
    std::copy_n(differences_around[1] - 2, width + 4, row(red_row ? M::green_minus_red : M::green_minus_blue, y) - 2);
    opposite_colour(green_rows, differences_around, scale, 2, width,
                    row(red_row ? M::green_minus_blue : M::green_minus_red, y));
    y = t - 7;
    if (y < band.begin) continue;
    const ColourRows r{{row(M::green, y - 1), row(M::green, y), row(M::green, y + 1)},
                       {row(M::green_minus_red, y - 1), row(M::green_minus_red, y), row(M::green_minus_red, y + 1)},
                       {row(M::green_minus_blue, y - 1), row(M::green_minus_blue, y), row(M::green_minus_blue, y + 1)}};
    Colours<T> chunk;
    for (int x = 0; x < width; x += kChunk) {
      const int count = std::min(kChunk, width - x);
      colours(r, green(y), scale, largest, x, count, chunk.r, chunk.g, chunk.b);
      store(chunk, count, band.result.row(y) + x);
    }
  }
}

// Non-template names for the dispatch tables.
void bilinear_colour8(const BilinearRow<std::uint8_t>& row, Rgb8* out) {
  bilinear_row(row, out);
}
void bilinear_luma8(const BilinearRow<std::uint8_t>& row, std::uint8_t* out) {
  bilinear_row(row, out);
}
void bilinear_colour16(const BilinearRow<std::uint16_t>& row, Rgb16* out) {
  bilinear_row(row, out);
}
void bilinear_luma16(const BilinearRow<std::uint16_t>& row, std::uint16_t* out) {
  bilinear_row(row, out);
}
void edge_aware_colour8(const Band<std::uint8_t, Rgb8>& band, BandBuffers& buffers) {
  edge_aware(band, buffers);
}
void edge_aware_luma8(const Band<std::uint8_t, std::uint8_t>& band, BandBuffers& buffers) {
  edge_aware(band, buffers);
}
void edge_aware_colour16(const Band<std::uint16_t, Rgb16>& band, BandBuffers& buffers) {
  edge_aware(band, buffers);
}
void edge_aware_luma16(const Band<std::uint16_t, std::uint16_t>& band, BandBuffers& buffers) {
  edge_aware(band, buffers);
}

}  // namespace spartan::internal::bayer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::internal::bayer {

HWY_EXPORT(bilinear_colour8);
HWY_EXPORT(bilinear_luma8);
HWY_EXPORT(bilinear_colour16);
HWY_EXPORT(bilinear_luma16);
HWY_EXPORT(edge_aware_colour8);
HWY_EXPORT(edge_aware_luma8);
HWY_EXPORT(edge_aware_colour16);
HWY_EXPORT(edge_aware_luma16);

template <>
Kernels<std::uint8_t> kernels_for(std::size_t target_index) {
  return {HWY_DISPATCH_TABLE(bilinear_colour8)[target_index], HWY_DISPATCH_TABLE(bilinear_luma8)[target_index],
          HWY_DISPATCH_TABLE(edge_aware_colour8)[target_index], HWY_DISPATCH_TABLE(edge_aware_luma8)[target_index]};
}
template <>
Kernels<std::uint16_t> kernels_for(std::size_t target_index) {
  return {HWY_DISPATCH_TABLE(bilinear_colour16)[target_index], HWY_DISPATCH_TABLE(bilinear_luma16)[target_index],
          HWY_DISPATCH_TABLE(edge_aware_colour16)[target_index], HWY_DISPATCH_TABLE(edge_aware_luma16)[target_index]};
}

BandBuffers::BandBuffers(int width)
    : width_(width),
      stride_((width + 2 * kMargin + 15) / 16 * 16),
      rows_(static_cast<std::size_t>(stride_ * (kPlanes * kRing + 2))) {
  std::int32_t* const even = rows_.data() + kPlanes * kRing * stride_ + kMargin;
  for (int x = -kMargin; x < width + kMargin; ++x) {
    even[x] = (x & 1) == 0 ? -1 : 0;
    even[stride_ + x] = ~even[x];
  }
}

}  // namespace spartan::internal::bayer
#endif  // HWY_ONCE
