#include "spartan/imaging/debayer_kernels.h"

#include <algorithm>
#include <cstdlib>

#include "spartan/core/luma.h"
#include "spartan/imaging/mirrored.h"

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/imaging/debayer_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spartan::bayer::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kChunk = 256;  // columns at a time, so that the colours of a chunk stay on the stack

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

/// Columns begin … begin + count, whose neighbours lie `left` before and `right` behind them.
template <class T>
HWY_INLINE void bilinear_chunk(const BilinearRow<T>& row, int begin, int count, int left, int right, Colours<T>& c) {
  const T *const above = row.above + begin, *const here = row.here + begin, *const below = row.below + begin;
  T* const own = row.red_row ? c.r : c.b;
  T* const other = row.red_row ? c.b : c.r;
  // Of two neighbours one is green; `odd` tells them apart without a branch.
  const unsigned first = (row.green_first ? 0U : 1U) ^ (static_cast<unsigned>(begin) & 1U);
  for (int i = 0; i < count; ++i) {
    const unsigned l = here[i - left], r = here[i + right], a = above[i], b = below[i];
    const bool green = ((static_cast<unsigned>(i) ^ first) & 1U) == 0;
    const T beside = mean<T>(l, r), upright = mean<T>(a, b);
    const T cross = mean<T>(a, b, l, r);
    const T diagonal = mean<T>(above[i - left], above[i + right], below[i - left], below[i + right]);
    own[i] = green ? beside : here[i];
    c.g[i] = green ? here[i] : cross;
    other[i] = green ? upright : diagonal;
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
// Rows hold values in 1/32 of a level. Row functions work from −margin to width + margin; `green` has all bits set
// where the mosaic's own sample is green.

using Row = std::int32_t*;
using ConstRow = const std::int32_t*;
constexpr int kUnitBits = 5, kUnit = 1 << kUnitBits;

template <class T>
void load(ImageView<const T> mosaic, int y, Row out) {
  const T* const in = mosaic.row(mirrored(y, mosaic.height()));
  const int width = mosaic.width();
  for (int x = 0; x < width; ++x) out[x] = kUnit * in[x];
  for (int i = 1; i <= BandMemory::kMargin; ++i) {
    out[-i] = out[mirrored(-i, width)];
    out[width - 1 + i] = out[mirrored(width - 1 + i, width)];
  }
}

/// Green minus the other colour, with the missing one of the two interpolated along the row and along the column.
void differences(const ConstRow m[5], ConstRow green, int margin, int width, Row HWY_RESTRICT across,
                 Row HWY_RESTRICT upright) {
  for (int x = -margin; x < width + margin; ++x) {
    const int own = m[2][x];
    const int h = (16 * (m[2][x - 1] + m[2][x + 1]) + 5 * (2 * own - m[2][x - 2] - m[2][x + 2])) >> kUnitBits;
    const int v = (16 * (m[1][x] + m[3][x]) + 5 * (2 * own - m[0][x] - m[4][x])) >> kUnitBits;
    across[x] = green[x] != 0 ? own - h : h - own;
    upright[x] = green[x] != 0 ? own - v : v - own;
  }
}

void steps(ConstRow before, ConstRow behind, int margin, int width, Row HWY_RESTRICT step) {
  for (int x = -margin; x < width + margin; ++x) step[x] = std::abs(before[x] - behind[x]);
}

void sums_of_nine(const ConstRow rows[3], int margin, int width, Row HWY_RESTRICT sum) {
  for (int x = -margin; x < width + margin; ++x) {
    sum[x] = rows[0][x - 1] + rows[0][x] + rows[0][x + 1] + rows[1][x - 1] + rows[1][x] + rows[1][x + 1] +
             rows[2][x - 1] + rows[2][x] + rows[2][x + 1];
  }
}

/// `chosen` where all bits of the mask are set, else `other`.
HWY_INLINE int select(int mask, int chosen, int other) {
  return other ^ ((other ^ chosen) & mask);
}

HWY_INLINE int rounded(float value) {
  return static_cast<int>(value + (value < 0 ? -0.5F : 0.5F));
}

struct GreenRows {
  ConstRow mosaic, across, upright[3], sum_across, sum_above, sum_below;
};

/// The mean of the differences of four sides, each by 1 / (its steps)².
void greens(const GreenRows& r, ConstRow green, float scale, int largest, int margin, int width,
            Row HWY_RESTRICT green_out, Row HWY_RESTRICT difference) {
  const auto squared = [=](int sum) HWY_ATTR {
    const float s = static_cast<float>(sum) * scale + 1.0F;
    return s * s;
  };
  for (int x = -margin; x < width + margin; ++x) {
    const float north = squared(r.sum_above[x]), south = squared(r.sum_below[x]);
    const float west = squared(r.sum_across[x - 1]), east = squared(r.sum_across[x + 1]);
    // 1/a : 1/b : 1/c : 1/d = bcd : acd : abd : abc
    const float beside = west * east, upright = north * south;
    const float to_north = south * beside, to_south = north * beside;
    const float to_west = east * upright, to_east = west * upright;
    const float total = (to_north + to_south) + (to_west + to_east);
    const float sum = (to_north * static_cast<float>(r.upright[1][x] + r.upright[0][x]) +
                       to_south * static_cast<float>(r.upright[1][x] + r.upright[2][x])) +
                      (to_west * static_cast<float>(r.across[x] + r.across[x - 1]) +
                       to_east * static_cast<float>(r.across[x] + r.across[x + 1]));
    const int own = r.mosaic[x];
    const int level = std::min(std::max(own + rounded(sum / (2 * total)), 0), largest);
    green_out[x] = select(green[x], own, level);
    difference[x] = level - own;
  }
}

/// Between two pairs of opposite neighbours: the mean of each pair, weighed by how straight the picture is along it.
HWY_INLINE int between_pairs(int a0, int a1, int b0, int b1, int steps_a, int steps_b, float scale) {
  const float weight_a = static_cast<float>(steps_b + std::abs(b0 - b1)) * scale + 1.0F;
  const float weight_b = static_cast<float>(steps_a + std::abs(a0 - a1)) * scale + 1.0F;
  const float sum = weight_a * static_cast<float>(a0 + a1) + weight_b * static_cast<float>(b0 + b1);
  return rounded(sum / (2 * (weight_a + weight_b)));
}

HWY_INLINE int bend(int before, int here, int behind) {
  return std::abs(before - behind) + std::abs(2 * here - before - behind);
}

/// At samples of one colour the difference of the other one, which lies on the diagonals.
void opposite_colour(const ConstRow green[3], const ConstRow difference[3], float scale, int margin, int width,
                     Row HWY_RESTRICT out) {
  for (int x = -margin; x < width + margin; ++x) {
    const int falling = bend(green[0][x - 1], green[1][x], green[2][x + 1]);
    const int rising = bend(green[0][x + 1], green[1][x], green[2][x - 1]);
    out[x] = between_pairs(difference[0][x - 1], difference[2][x + 1], difference[0][x + 1], difference[2][x - 1],
                           falling, rising, scale);
  }
}

template <class T>
HWY_INLINE T level_of(int value, int largest) {
  return static_cast<T>((std::min(std::max(value, 0), largest) + kUnit / 2) >> kUnitBits);
}

struct ColourRows {
  ConstRow green[3], to_red[3], to_blue[3];
};

template <class T>
void colours(const ColourRows& rows, ConstRow green, float scale, int largest, int begin, int count,
             T* HWY_RESTRICT red_out, T* HWY_RESTRICT green_out, T* HWY_RESTRICT blue_out) {
  const ColourRows r = rows;
  for (int i = 0; i < count; ++i) {
    const int x = begin + i, own = r.green[1][x], own_red = r.to_red[1][x], own_blue = r.to_blue[1][x];
    const int upright = bend(r.green[0][x], own, r.green[2][x]);
    const int beside = bend(r.green[1][x - 1], own, r.green[1][x + 1]);
    const int red =
        between_pairs(r.to_red[0][x], r.to_red[2][x], r.to_red[1][x - 1], r.to_red[1][x + 1], upright, beside, scale);
    const int blue = between_pairs(r.to_blue[0][x], r.to_blue[2][x], r.to_blue[1][x - 1], r.to_blue[1][x + 1], upright,
                                   beside, scale);
    red_out[i] = level_of<T>(own - select(green[x], red, own_red), largest);
    green_out[i] = level_of<T>(own, largest);
    blue_out[i] = level_of<T>(own - select(green[x], blue, own_blue), largest);
  }
}

template <class T, class Pixel>
void edge_aware(const Band<T, Pixel>& band, BandMemory& memory) {
  using M = BandMemory;
  const int width = band.mosaic.width();
  const int largest = kUnit * band.full_scale;
  // Steps count in levels of 8 bits whatever the depth: the picture is the same, and their products stay within the
  // range of a float. Full scales are a step below a power of two, so the quotient is one.
  const int level = band.full_scale / 256 + 1;
  const float scale = 1.0F / static_cast<float>(kUnit * level);
  const auto green = [&](int y) HWY_ATTR { return memory.columns(band.red.is_green(0, y)); };
  const auto row = [&](M::Plane plane, int y) HWY_ATTR { return memory.row(plane, y); };
  // Each step follows the one before it by the rows that it needs around its own.
  for (int t = band.begin - 7; t < band.end + 7; ++t) {
    load(band.mosaic, t, row(M::mosaic, t));
    int y = t - 2;
    const ConstRow around[5] = {row(M::mosaic, y - 2), row(M::mosaic, y - 1), row(M::mosaic, y), row(M::mosaic, y + 1),
                                row(M::mosaic, y + 2)};
    differences(around, green(y), 6, width, row(M::across, y), row(M::upright, y));
    steps(row(M::across, y) - 1, row(M::across, y) + 1, 5, width, row(M::step_across, y));
    y = t - 3;
    steps(row(M::upright, y - 1), row(M::upright, y + 1), 5, width, row(M::step_upright, y));
    y = t - 4;
    for (const auto& [step, sum] : {std::pair{M::step_across, M::sum_across}, {M::step_upright, M::sum_upright}}) {
      const ConstRow three[3] = {row(step, y - 1), row(step, y), row(step, y + 1)};
      sums_of_nine(three, 4, width, row(sum, y));
    }
    y = t - 5;
    greens({row(M::mosaic, y),
            row(M::across, y),
            {row(M::upright, y - 1), row(M::upright, y), row(M::upright, y + 1)},
            row(M::sum_across, y),
            row(M::sum_upright, y - 1),
            row(M::sum_upright, y + 1)},
           green(y), scale, largest, 3, width, row(M::green, y), row(M::difference, y));
    y = t - 6;
    const ConstRow green_rows[3] = {row(M::green, y - 1), row(M::green, y), row(M::green, y + 1)};
    const ConstRow differences_around[3] = {row(M::difference, y - 1), row(M::difference, y),
                                            row(M::difference, y + 1)};
    const bool red_row = band.red.is_red_row(y);
    std::copy_n(differences_around[1] - 2, width + 4, row(red_row ? M::to_red : M::to_blue, y) - 2);
    opposite_colour(green_rows, differences_around, scale, 2, width, row(red_row ? M::to_blue : M::to_red, y));
    y = t - 7;
    if (y < band.begin) continue;
    const ColourRows r{{row(M::green, y - 1), row(M::green, y), row(M::green, y + 1)},
                       {row(M::to_red, y - 1), row(M::to_red, y), row(M::to_red, y + 1)},
                       {row(M::to_blue, y - 1), row(M::to_blue, y), row(M::to_blue, y + 1)}};
    Colours<T> chunk;
    for (int x = 0; x < width; x += kChunk) {
      const int count = std::min(kChunk, width - x);
      colours(r, green(y), scale, largest, x, count, chunk.r, chunk.g, chunk.b);
      store(chunk, count, band.result.row(y) + x);
    }
  }
}

// Names without templates, for the dispatch tables.
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
void edge_aware_colour8(const Band<std::uint8_t, Rgb8>& band, BandMemory& memory) {
  edge_aware(band, memory);
}
void edge_aware_luma8(const Band<std::uint8_t, std::uint8_t>& band, BandMemory& memory) {
  edge_aware(band, memory);
}
void edge_aware_colour16(const Band<std::uint16_t, Rgb16>& band, BandMemory& memory) {
  edge_aware(band, memory);
}
void edge_aware_luma16(const Band<std::uint16_t, std::uint16_t>& band, BandMemory& memory) {
  edge_aware(band, memory);
}

}  // namespace spartan::bayer::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::bayer {

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

BandMemory::BandMemory(int width)
    : width_(width),
      stride_((width + 2 * kMargin + 15) / 16 * 16),
      rows_(static_cast<std::size_t>(stride_ * (kPlanes * kRing + 2))) {
  std::int32_t* const even = rows_.data() + kPlanes * kRing * stride_ + kMargin;
  for (int x = -kMargin; x < width + kMargin; ++x) {
    even[x] = (x & 1) == 0 ? -1 : 0;
    even[stride_ + x] = ~even[x];
  }
}

}  // namespace spartan::bayer
#endif  // HWY_ONCE
