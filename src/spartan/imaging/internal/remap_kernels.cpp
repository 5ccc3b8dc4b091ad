#include "spartan/imaging/internal/remap_kernels.h"

#include <hwy/cache_control.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/imaging/internal/remap_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spartan::internal::remap::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

constexpr int kOverwrite = 2;  // pixels after a cell, of which the widest store may overwrite up to four bytes

/// Pixel `at` of a cell by the scalar reference.
template <class Pixel>
HWY_INLINE void remap_pixel(const Cell& cell, int at, const Source<Pixel>& source, Pixel* out) {
  out[at] = cell.codes[at] == kInvalid || cell.kinds[at / kBlock] == kScattered
                ? Pixel{}
                : sample(source, source_pixel(cell, at), cell.fraction_x[at], cell.fraction_y[at]);
}

#if HWY_TARGET == HWY_SCALAR

template <class Pixel>
void remap_cell(const Cell& cell, const Source<Pixel>& source, Pixel* out) {
  for (int at = 0; at < kCell; ++at) remap_pixel(cell, at, source, out);
}

#else

/// Loads 16 bytes per block, `step` rows below the corner of the block.
template <class D>
HWY_INLINE hn::Vec<D> load_rows(D d, const SourcePixel* corners, int step, const Source<std::uint8_t>& s) {
  constexpr std::size_t kLanes = hn::MaxLanes(D());
  if constexpr (kLanes > static_cast<std::size_t>(kLoad)) {
    const hn::Half<D> half;
    const auto low = load_rows(half, corners, step, s);
    return hn::Combine(d, load_rows(half, corners + kLanes / kLoad / 2, step, s), low);
  } else {
    return hn::LoadU(d, s.data + std::min(corners->y + step, s.height - 1) * s.stride + corners->x);
  }
}

/// Interpolates lanes / 16 blocks starting at `block`; each reads at most `rows` source rows.
template <class D>
HWY_INLINE void remap_blocks(D d, const Cell& cell, const Source<std::uint8_t>& source, int block, int rows,
                             std::uint8_t* out) {
  const hn::Repartition<std::int16_t, D> d16;
  const hn::Rebind<std::uint8_t, decltype(d16)> bytes;
  const int x = block * kBlock;
  const SourcePixel* const corners = cell.corners + block;

  // Each 16-bit lane holds the left and right sample of a pixel: their shuffle indices, then the samples. Invalid
  // pixels have indices above 0x7F, which give 0.
  const auto code = hn::PromoteTo(d16, hn::LoadU(bytes, cell.codes + x));
  const auto column = hn::And(code, hn::Set(d16, 0x8F));
  const auto byte_indices = hn::BitCast(d, hn::Add(hn::Or(column, hn::ShiftLeft<8>(column)), hn::Set(d16, 0x100)));
  const auto samples = [&](int step) HWY_ATTR {
    return hn::BitCast(d16, hn::TableLookupBytesOr0(load_rows(d, corners, step, source), byte_indices));
  };
  const auto steps = hn::And(code, hn::Set(d16, 0x70));
  auto top = samples(0), below = samples(1), bottom = below;
  for (int r = 1; r + 1 < rows; ++r) {
    const auto starts_here = hn::Eq(steps, hn::Set(d16, static_cast<std::int16_t>(16 * r)));
    const auto next = samples(r + 1);
    top = hn::IfThenElse(starts_here, below, top);
    bottom = hn::IfThenElse(starts_here, next, bottom);
    below = next;
  }

  const auto fraction_x = hn::PromoteTo(d16, hn::LoadU(bytes, cell.fraction_x + x));
  const auto fraction_y = hn::ShiftLeft<8>(hn::PromoteTo(d16, hn::LoadU(bytes, cell.fraction_y + x)));
  const hn::RebindToUnsigned<decltype(d16)> u16;
  const auto interpolate_x = [&](auto pair) HWY_ATTR {
    const auto left = hn::And(pair, hn::Set(d16, 0xFF));
    const auto right = hn::BitCast(d16, hn::ShiftRight<8>(hn::BitCast(u16, pair)));
    return hn::Add(hn::ShiftLeft<kFractionBits>(left), hn::Mul(fraction_x, hn::Sub(right, left)));
  };
  top = interpolate_x(top);
  bottom = interpolate_x(bottom);
  // MulFixedPoint15(a, b · 2⁸) = round(a b / 2⁷).
  const auto level = hn::Add(top, hn::MulFixedPoint15(hn::Sub(bottom, top), fraction_y));
  const auto rounded = hn::ShiftRight<kFractionBits>(hn::Add(level, hn::Set(d16, kOne / 2)));
  hn::StoreU(hn::DemoteTo(bytes, rounded), bytes, out + x);
}

#if HWY_HAVE_SCALABLE
using Wide = hn::FixedTag<std::uint8_t, kLoad>;
#else
using Wide = hn::CappedTag<std::uint8_t, kBlocks * kLoad>;
#endif

HWY_INLINE void remap_cell(const Cell& cell, const Source<std::uint8_t>& source, std::uint8_t* out) {
  const Wide d;
  constexpr int kAtOnce = static_cast<int>(hn::MaxLanes(d)) / kLoad;
  const std::uint8_t highest = *std::max_element(cell.kinds, cell.kinds + kBlocks);
  if (highest == 0) {
    for (int b = 0; b < kBlocks; b += kAtOnce) remap_blocks(d, cell, source, b, 3, out);
  } else if (highest != kScattered) {
    for (int b = 0; b < kBlocks; b += kAtOnce) remap_blocks(d, cell, source, b, 3 + highest, out);
  } else {
    for (int b = 0; b < kBlocks; ++b) {
      if (cell.kinds[b] == kScattered) {
        std::fill_n(out + b * kBlock, kBlock, std::uint8_t{0});
      } else {
        remap_blocks(hn::FixedTag<std::uint8_t, kLoad>(), cell, source, b, 3 + cell.kinds[b], out);
      }
    }
  }
}

// The other pixel types: one load per source row fetches two neighbouring pixels with all their channels (a piece), and
// eight result pixels are interpolated together.

/// Indices for a byte shuffle within each 16 bytes of a vector of pieces; kNone gives 0.
constexpr std::uint8_t kNone = 0x80;
using Shuffle = std::array<std::uint8_t, kBlocks * kLoad>;

/// The index of the piece, in the lowest byte of each of its lanes.
constexpr Shuffle number_of_piece(std::size_t piece_bytes, std::size_t lane_bytes) {
  Shuffle result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i] = i % lane_bytes == 0 ? static_cast<std::uint8_t>(i / piece_bytes) : kNone;
  }
  return result;
}

/// Repeats the shuffle of one group of bytes for every group.
template <std::size_t kBytes>
constexpr Shuffle in_each(const std::array<std::uint8_t, kBytes>& group) {
  Shuffle result{};
  for (std::size_t i = 0; i < result.size(); ++i) {
    const std::uint8_t from = group[i % kBytes];
    result[i] = from == kNone ? kNone : static_cast<std::uint8_t>(from + i % kLoad / kBytes * kBytes);
  }
  return result;
}

template <class D>
HWY_INLINE hn::Vec<D> load_shuffle(D d, const Shuffle& shuffle) {
  return hn::LoadU(d, shuffle.data());
}

/// `interpolate` for 16-bit samples: the left and right sample share a lane of 32 bits.
template <class D>
HWY_INLINE auto levels16(D /*d*/, hn::Vec<D> top_pairs, hn::Vec<D> bottom_pairs, hn::Vec<D> fraction_x,
                         hn::Vec<D> fraction_y) {
  const hn::Repartition<std::int32_t, D> d32;
  const hn::Repartition<std::int16_t, D> d16;
  const hn::Rebind<std::int16_t, decltype(d32)> half16;
  const hn::RebindToUnsigned<decltype(half16)> words;
  const auto x = hn::BitCast(d32, fraction_x), y = hn::BitCast(d32, fraction_y);
  const auto weights = hn::BitCast(d16, hn::Add(hn::ShiftLeft<16>(x), hn::Sub(hn::Set(d32, kOne), x)));
  // The multiplication is signed: samples are offset by −2¹⁵, which cancels in differences and is undone at the end.
  const auto interpolate_x = [&](auto pairs) HWY_ATTR {
    const auto samples = hn::Xor(hn::BitCast(d16, pairs), hn::Set(d16, std::numeric_limits<std::int16_t>::min()));
    auto rest = hn::Zero(d32);
    const auto sums = hn::ReorderWidenMulAccumulate(d32, samples, weights, hn::Zero(d32), rest);
    return hn::RearrangeToOddPlusEven(sums, rest);
  };
  const auto top = interpolate_x(top_pairs), bottom = interpolate_x(bottom_pairs);
  const auto half = hn::Set(d32, kOne / 2);
  const auto weighted = hn::ShiftRight<kFractionBits>(hn::Add(hn::Mul(y, hn::Sub(bottom, top)), half));
  const auto level = hn::ShiftRight<kFractionBits>(hn::Add(hn::Add(top, weighted), half));
  const auto biased = hn::BitCast(words, hn::DemoteTo(half16, level));
  return hn::Xor(biased, hn::Set(words, std::uint16_t{1} << 15));
}

/// Traits of a pixel type: bytes loaded per piece (possibly more than it has), bytes per lane of the arithmetic, and
/// levels(), which interpolates the pieces of a vector and packs the results in each 16 bytes.
template <class Pixel>
struct Format;

template <>
struct Format<std::uint16_t> {
  static constexpr std::size_t kPiece = 4, kLane = 4;
  template <class D>
  static HWY_INLINE auto levels(D d, hn::Vec<D> top, hn::Vec<D> bottom, hn::Vec<D> fraction_x, hn::Vec<D> fraction_y) {
    return levels16(d, top, bottom, fraction_x, fraction_y);
  }
};

template <>
struct Format<Rgb16> {
  static constexpr std::size_t kPiece = 16, kLane = 4;
  template <class D>
  static HWY_INLINE auto levels(D d, hn::Vec<D> top, hn::Vec<D> bottom, hn::Vec<D> fraction_x, hn::Vec<D> fraction_y) {
    static constexpr Shuffle kPairs = in_each<16>({0, 1, 6, 7, 2, 3, 8, 9, 4, 5, 10, 11, kNone, kNone, kNone, kNone});
    const auto pairs = load_shuffle(d, kPairs);
    const auto rgb0 = levels16(d, hn::TableLookupBytesOr0(top, pairs), hn::TableLookupBytesOr0(bottom, pairs),
                               fraction_x, fraction_y);
    static constexpr Shuffle kClose = in_each<16>({0, 1, 2, 3, 4, 5, 8, 9, 10, 11, 12, 13, kNone, kNone, kNone, kNone});
    const hn::Half<D> half;
    return hn::TableLookupBytes(hn::BitCast(half, rgb0), load_shuffle(half, kClose));
  }
};

template <>
struct Format<Rgb8> {
  static constexpr std::size_t kPiece = 8, kLane = 2;
  template <class D>
  static HWY_INLINE auto levels(D d, hn::Vec<D> top_pieces, hn::Vec<D> bottom_pieces, hn::Vec<D> fraction_x,
                                hn::Vec<D> fraction_y) {
    const hn::Repartition<std::int16_t, D> d16;
    const hn::Half<D> half;
    static constexpr Shuffle kLeft = in_each<8>({0, kNone, 1, kNone, 2, kNone, kNone, kNone});
    static constexpr Shuffle kRight = in_each<8>({3, kNone, 4, kNone, 5, kNone, kNone, kNone});
    const auto interpolate_x = [&](auto pieces) HWY_ATTR {
      const auto left = hn::BitCast(d16, hn::TableLookupBytesOr0(pieces, load_shuffle(d, kLeft)));
      const auto right = hn::BitCast(d16, hn::TableLookupBytesOr0(pieces, load_shuffle(d, kRight)));
      return hn::Add(hn::ShiftLeft<kFractionBits>(left), hn::Mul(hn::BitCast(d16, fraction_x), hn::Sub(right, left)));
    };
    const auto top = interpolate_x(top_pieces), bottom = interpolate_x(bottom_pieces);
    const auto weighted = hn::MulFixedPoint15(hn::Sub(bottom, top), hn::ShiftLeft<8>(hn::BitCast(d16, fraction_y)));
    const auto level = hn::ShiftRight<kFractionBits>(hn::Add(hn::Add(top, weighted), hn::Set(d16, kOne / 2)));
    static constexpr Shuffle kClose = in_each<16>({0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, kNone, kNone, kNone, kNone});
    return hn::TableLookupBytes(hn::DemoteTo(half, level), load_shuffle(half, kClose));
  }
};

/// Loads one piece per pixel at byte offsets from `from`.
template <std::size_t kPiece, class D>
HWY_INLINE hn::Vec<D> load_pieces(D d, const std::uint8_t* from, const std::int32_t* offsets) {
  constexpr std::size_t kPieces = hn::MaxLanes(D()) / kPiece;
  if constexpr (kPieces > 1) {
    const hn::Half<D> half;
    const auto low = load_pieces<kPiece>(half, from, offsets);
    return hn::Combine(d, load_pieces<kPiece>(half, from, offsets + kPieces / 2), low);
  } else {
    return hn::LoadU(d, from + *offsets);
  }
}

/// Stores the `kPixels` pixels of each 16 bytes consecutively; may overwrite `kOverwrite` pixels after the last.
template <int kPixels, class D, class Pixel>
HWY_INLINE void store_pixels(D d, hn::Vec<D> pixels, Pixel* out) {
  if constexpr (hn::MaxLanes(D()) > static_cast<std::size_t>(kLoad)) {
    const hn::Half<D> half;
    store_pixels<kPixels>(half, hn::LowerHalf(half, pixels), out);
    store_pixels<kPixels>(half, hn::UpperHalf(half, pixels), out + kPixels);
  } else {
    hn::StoreU(pixels, d, reinterpret_cast<std::uint8_t*>(out));
  }
}

/// Byte offset of each pixel of a cell from the corner of its block; 0 for invalid pixels.
template <class Pixel>
HWY_INLINE std::array<std::int32_t, kCell> offsets_in(const Cell& cell, const Source<Pixel>& source) {
  const hn::CappedTag<std::int32_t, kCell> d;
  const hn::Rebind<std::uint8_t, decltype(d)> bytes;
  const auto row_bytes =
      hn::Set(d, static_cast<std::int32_t>(source.stride) * static_cast<std::int32_t>(sizeof(Pixel)));
  std::array<std::int32_t, kCell> offsets;
  for (std::size_t i = 0; i < offsets.size(); i += hn::Lanes(d)) {
    const auto code = hn::PromoteTo(d, hn::LoadU(bytes, cell.codes + i));
    const auto row = hn::And(hn::ShiftRight<4>(code), hn::Set(d, kMaxRowOffset));
    const auto column = hn::And(code, hn::Set(d, 15));
    hn::StoreU(hn::Add(hn::Mul(row, row_bytes), hn::Mul(column, hn::Set(d, sizeof(Pixel)))), d, offsets.data() + i);
  }
  return offsets;
}

/// Interpolates a block that is not scattered and ends at least one row above the last source row, since loads may read
/// a few bytes past the end of a row.
template <class Pixel>
HWY_INLINE void remap_block(const Cell& cell, const Source<Pixel>& source, const std::int32_t* offsets, int block,
                            Pixel* out) {
  using F = Format<Pixel>;
  constexpr std::size_t kBytes = kBlock * F::kPiece;
#if HWY_HAVE_SCALABLE
  const hn::FixedTag<std::uint8_t, kLoad> d;
#else
  const hn::CappedTag<std::uint8_t, std::min<std::size_t>(kBytes, kBlocks * kLoad)> d;
#endif
  constexpr int kAtOnce = static_cast<int>(hn::MaxLanes(d) / F::kPiece);

  const SourcePixel corner = cell.corners[block];
  const auto* const top = reinterpret_cast<const std::uint8_t*>(source.data + corner.y * source.stride + corner.x);
  const auto* const bottom = top + source.stride * static_cast<std::ptrdiff_t>(sizeof(Pixel));

  static constexpr Shuffle kNumbers = number_of_piece(F::kPiece, F::kLane);
  const int half_cell = block / 2 * kLoad;
  const auto fractions_x = hn::LoadDup128(d, cell.fraction_x + half_cell),
             fractions_y = hn::LoadDup128(d, cell.fraction_y + half_cell);
  for (int i = 0; i < kBlock; i += kAtOnce) {
    const auto first = static_cast<std::uint8_t>(block % 2 * kBlock + i);
    const auto numbers = hn::Add(load_shuffle(d, kNumbers), hn::Set(d, first));
    const auto pixels =
        F::levels(d, load_pieces<F::kPiece>(d, top, offsets + i), load_pieces<F::kPiece>(d, bottom, offsets + i),
                  hn::TableLookupBytesOr0(fractions_x, numbers), hn::TableLookupBytesOr0(fractions_y, numbers));
    const hn::Half<decltype(d)> half;
    store_pixels<static_cast<int>(2 * kLoad / F::kPiece)>(half, hn::BitCast(half, pixels), out + block * kBlock + i);
  }
}

/// May overwrite `kOverwrite` pixels after the cell.
template <class Pixel>
HWY_INLINE void remap_cell(const Cell& cell, const Source<Pixel>& source, Pixel* out) {
  const auto offsets = offsets_in(cell, source);
  for (int b = 0; b < kBlocks; ++b) {
    std::uint64_t codes;
    std::memcpy(&codes, cell.codes + b * kBlock, sizeof codes);
    constexpr std::uint64_t kAllUnseen = 0x8080808080808080;
    if (cell.kinds[b] == kScattered || codes == kAllUnseen) {
      std::fill_n(out + b * kBlock, kBlock, Pixel{});
    } else if (cell.corners[b].y + cell.kinds[b] + 3 < source.height) {
      remap_block(cell, source, offsets.data() + b * kBlock, b, out);
      for (int at = b * kBlock; (codes & kAllUnseen) != 0 && at < (b + 1) * kBlock; ++at) {
        if (cell.codes[at] == kInvalid) out[at] = Pixel{};
      }
    } else {
      for (int at = b * kBlock; at < (b + 1) * kBlock; ++at) remap_pixel(cell, at, source, out);
    }
  }
}

#endif  // HWY_TARGET == HWY_SCALAR

/// Prefetches the source row that the pixels of a cell are the first to read, once per cache line.
template <class Pixel>
HWY_INLINE void fetch(const Cell& cell, const Source<Pixel>& source) {
  constexpr int kBlocksALine = std::clamp(static_cast<int>(64 / sizeof(Pixel)) / kBlock, 1, kBlocks);
  for (int b = 0; b < kBlocks; b += kBlocksALine) {
    const SourcePixel corner = cell.corners[b];
    hwy::Prefetch(source.data + std::min(corner.y + 2, source.height - 1) * source.stride + corner.x);
  }
}

template <class Pixel>
HWY_INLINE void remap_row(const Cell* cells, const Cell* prefetched, int width, const Source<Pixel>& source,
                          Pixel* out) {
  for (; width >= kCell + kOverwrite; width -= kCell, out += kCell) {
    fetch(*prefetched++, source);
    remap_cell(*cells++, source, out);
  }
  for (; width > 0; width -= kCell, out += kCell) {
    fetch(*prefetched++, source);
    std::array<Pixel, kCell + kOverwrite> last;
    remap_cell(*cells++, source, last.data());
    std::copy_n(last.data(), std::min(width, kCell), out);
  }
}

// Non-template names for the dispatch tables.
void gray8(const Cell* cells, const Cell* prefetched, int width, const Source<std::uint8_t>& source,
           std::uint8_t* out) {
  remap_row(cells, prefetched, width, source, out);
}
void gray16(const Cell* cells, const Cell* prefetched, int width, const Source<std::uint16_t>& source,
            std::uint16_t* out) {
  remap_row(cells, prefetched, width, source, out);
}
void colour8(const Cell* cells, const Cell* prefetched, int width, const Source<Rgb8>& source, Rgb8* out) {
  remap_row(cells, prefetched, width, source, out);
}
void colour16(const Cell* cells, const Cell* prefetched, int width, const Source<Rgb16>& source, Rgb16* out) {
  remap_row(cells, prefetched, width, source, out);
}

}  // namespace spartan::internal::remap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::internal::remap {

HWY_EXPORT(gray8);
HWY_EXPORT(gray16);
HWY_EXPORT(colour8);
HWY_EXPORT(colour16);

Kernels kernels_for(std::size_t target_index) {
  return {HWY_DISPATCH_TABLE(gray8)[target_index], HWY_DISPATCH_TABLE(gray16)[target_index],
          HWY_DISPATCH_TABLE(colour8)[target_index], HWY_DISPATCH_TABLE(colour16)[target_index]};
}

}  // namespace spartan::internal::remap
#endif  // HWY_ONCE
