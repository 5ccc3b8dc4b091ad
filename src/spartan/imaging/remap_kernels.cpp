#include "spartan/imaging/remap_kernels.h"

#include <algorithm>
#include <array>

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/imaging/remap_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spartan::remap::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Pixel `at` of a cell in the plain way.
template <class Pixel>
HWY_INLINE void remap_pixel(const Cell& cell, int at, const Source<Pixel>& source, Pixel* out) {
  out[at] = cell.codes[at] == kUnseen || cell.kinds[at / kBlock] == kScattered
                ? Pixel{}
                : sample(source, place_of(cell, at), cell.part_x[at], cell.part_y[at]);
}

#if HWY_TARGET == HWY_SCALAR

template <class Pixel>
void remap_cell(const Cell& cell, const Source<Pixel>& source, Pixel* out) {
  for (int at = 0; at < kCell; ++at) remap_pixel(cell, at, source, out);
}

#else

/// 16 bytes for each block of the vector, all `step` rows below its corner.
template <class D>
HWY_INLINE hn::Vec<D> load_rows(D d, const Place* corners, int step, const Source<std::uint8_t>& s) {
  constexpr std::size_t kLanes = hn::MaxLanes(D());
  if constexpr (kLanes > static_cast<std::size_t>(kLoad)) {
    const hn::Half<D> half;
    const auto low = load_rows(half, corners, step, s);
    return hn::Combine(d, load_rows(half, corners + kLanes / kLoad / 2, step, s), low);
  } else {
    return hn::LoadU(d, s.data + std::min(corners->y + step, s.height - 1) * s.stride + corners->x);
  }
}

/// As many blocks as `d` has 16 bytes, from `block` on; each looks at no more than `rows` source rows.
template <class D>
HWY_INLINE void remap_blocks(D d, const Cell& cell, const Source<std::uint8_t>& source, int block, int rows,
                             std::uint8_t* out) {
  const hn::Repartition<std::int16_t, D> d16;
  const hn::Rebind<std::uint8_t, decltype(d16)> bytes;
  const int x = block * kBlock;
  const Place* const corners = cell.corners + block;

  // Each 16-bit lane becomes a pixel: first the places of its two bytes, then the bytes. Those of unseen pixels are 0.
  const auto code = hn::PromoteTo(d16, hn::LoadU(bytes, cell.codes + x));
  const auto column = hn::And(code, hn::Set(d16, 0x8F));
  const auto places = hn::BitCast(d, hn::Add(hn::Or(column, hn::ShiftLeft<8>(column)), hn::Set(d16, 0x100)));
  const auto samples = [&](int step) HWY_ATTR {
    return hn::BitCast(d16, hn::TableLookupBytesOr0(load_rows(d, corners, step, source), places));
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

  const auto part_x = hn::PromoteTo(d16, hn::LoadU(bytes, cell.part_x + x));
  const auto part_y = hn::ShiftLeft<8>(hn::PromoteTo(d16, hn::LoadU(bytes, cell.part_y + x)));
  const hn::RebindToUnsigned<decltype(d16)> u16;
  const auto across = [&](auto pair) HWY_ATTR {
    const auto left = hn::And(pair, hn::Set(d16, 0xFF));
    const auto right = hn::BitCast(d16, hn::ShiftRight<8>(hn::BitCast(u16, pair)));
    return hn::Add(hn::ShiftLeft<kFractionBits>(left), hn::Mul(part_x, hn::Sub(right, left)));
  };
  top = across(top);
  bottom = across(bottom);
  // a · (b · 2⁸) by MulFixedPoint15 is round(a b / 2⁷).
  const auto level = hn::Add(top, hn::MulFixedPoint15(hn::Sub(bottom, top), part_y));
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

/// `interpolate` in lanes of 32 bits.
template <class D, class V = hn::Vec<D> >
HWY_INLINE V between_lanes(D d, V s00, V s10, V s01, V s11, V part_x, V part_y) {
  const auto half = hn::Set(d, kOne / 2);
  const auto top = hn::Add(hn::ShiftLeft<kFractionBits>(s00), hn::Mul(part_x, hn::Sub(s10, s00)));
  const auto bottom = hn::Add(hn::ShiftLeft<kFractionBits>(s01), hn::Mul(part_x, hn::Sub(s11, s01)));
  const auto share = hn::ShiftRight<kFractionBits>(hn::Add(hn::Mul(part_y, hn::Sub(bottom, top)), half));
  return hn::ShiftRight<kFractionBits>(hn::Add(hn::Add(top, share), half));
}

#if HWY_TARGET <= HWY_AVX2  // the targets that have a gather, from AVX2 up

/// A block at a time: both columns of a pixel are the halves of one 32-bit lane.
HWY_INLINE void remap_block16(const Cell& cell, const Source<std::uint16_t>& source, int block, std::uint16_t* out) {
  const hn::CappedTag<std::int32_t, kBlock> d;
  const hn::RebindToUnsigned<decltype(d)> u32;
  const hn::Rebind<std::uint8_t, decltype(d)> bytes;
  const hn::Rebind<std::uint16_t, decltype(d)> words;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const Place corner = cell.corners[block];
  const auto* const base = reinterpret_cast<const std::int32_t*>(source.data + corner.y * source.stride + corner.x);
  const auto stride = hn::Set(d, static_cast<std::int32_t>(source.stride) * 2);
  for (int at = block * kBlock; at < (block + 1) * kBlock; at += lanes) {
    const auto code = hn::PromoteTo(d, hn::LoadU(bytes, cell.codes + at));
    const auto seen = hn::Lt(code, hn::Set(d, kUnseen));
    const auto row = hn::And(hn::ShiftRight<4>(code), hn::Set(d, kLargestStep));
    const auto column = hn::And(code, hn::Set(d, 15));
    const auto place = hn::Add(hn::Mul(row, stride), hn::ShiftLeft<1>(column));
    const auto below = hn::Lt(row, hn::Set(d, source.height - 1 - corner.y));
    const auto p = hn::GatherOffset(d, base, place);
    const auto q = hn::GatherOffset(d, base, hn::Add(place, hn::IfThenElseZero(below, stride)));
    const auto first = [&](auto pair) HWY_ATTR { return hn::And(pair, hn::Set(d, 0xFFFF)); };
    const auto second = [&](auto pair) HWY_ATTR { return hn::BitCast(d, hn::ShiftRight<16>(hn::BitCast(u32, pair))); };
    const auto level =
        between_lanes(d, first(p), second(p), first(q), second(q), hn::PromoteTo(d, hn::LoadU(bytes, cell.part_x + at)),
                      hn::PromoteTo(d, hn::LoadU(bytes, cell.part_y + at)));
    hn::StoreU(hn::DemoteTo(words, hn::IfThenElseZero(seen, level)), words, out + at);
  }
}

#else

HWY_INLINE void remap_block16(const Cell& cell, const Source<std::uint16_t>& source, int block, std::uint16_t* out) {
  for (int at = block * kBlock; at < (block + 1) * kBlock; ++at) remap_pixel(cell, at, source, out);
}

#endif  // HWY_TARGET <= HWY_AVX2

void remap_cell(const Cell& cell, const Source<std::uint16_t>& source, std::uint16_t* out) {
  for (int b = 0; b < kBlocks; ++b) {
    if (cell.kinds[b] != kScattered) {
      remap_block16(cell, source, b, out);
    } else {
      std::fill_n(out + b * kBlock, kBlock, std::uint16_t{0});
    }
  }
}

/// One pixel with all its channels: r g b of one column, then of the next. Writes four samples.
HWY_INLINE void remap_colour(const std::uint8_t* p, const std::uint8_t* q, int part_x, int part_y, std::uint8_t* out) {
  const hn::FixedTag<std::int16_t, 8> d;
  const hn::Rebind<std::uint8_t, decltype(d)> bytes;
  const auto across = [&](const std::uint8_t* from) HWY_ATTR {
    const auto left = hn::PromoteTo(d, hn::LoadU(bytes, from));
    const auto right = hn::ShiftRightBytes<6>(d, left);
    return hn::Add(hn::ShiftLeft<kFractionBits>(left),
                   hn::Mul(hn::Set(d, static_cast<std::int16_t>(part_x)), hn::Sub(right, left)));
  };
  const auto top = across(p), bottom = across(q);
  const auto share = hn::MulFixedPoint15(hn::Sub(bottom, top), hn::Set(d, static_cast<std::int16_t>(part_y << 8)));
  const auto level = hn::ShiftRight<kFractionBits>(hn::Add(hn::Add(top, share), hn::Set(d, kOne / 2)));
  const hn::FixedTag<std::uint8_t, 4> four;
  const hn::FixedTag<std::uint8_t, 8> eight;
  hn::StoreU(hn::LowerHalf(four, hn::DemoteTo(eight, level)), four, out);
}
HWY_INLINE void remap_colour(const std::uint16_t* p, const std::uint16_t* q, int part_x, int part_y,
                             std::uint16_t* out) {
  const hn::FixedTag<std::int32_t, 4> d;
  const hn::Rebind<std::uint16_t, decltype(d)> words;
  const auto of = [&](const std::uint16_t* from) HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(words, from)); };
  const auto level = between_lanes(d, of(p), of(p + 3), of(q), of(q + 3), hn::Set(d, part_x), hn::Set(d, part_y));
  hn::StoreU(hn::DemoteTo(words, level), words, out);
}

template <class T>
HWY_INLINE void remap_cell(const Cell& cell, const Source<Rgb<T> >& source, Rgb<T>* out) {
  // Loads and stores reach a pixel further than they need: the last ones go the plain way.
  const int last_column = source.width - 4;
  for (int at = 0; at < kCell - 1; ++at) {
    const int code = cell.codes[at];
    const Place corner = cell.corners[at / kBlock];
    const int x = corner.x + (code & 15), y = corner.y + (code >> 4);
    if (code == kUnseen || cell.kinds[at / kBlock] == kScattered || x > last_column) {
      remap_pixel(cell, at, source, out);
      continue;
    }
    const Rgb<T>* const p = source.data + y * source.stride + x;
    const Rgb<T>* const q = p + (y + 1 < source.height ? source.stride : 0);
    remap_colour(&p->r, &q->r, cell.part_x[at], cell.part_y[at], &out[at].r);
  }
  remap_pixel(cell, kCell - 1, source, out);
}

#endif  // HWY_TARGET == HWY_SCALAR

template <class Pixel>
HWY_INLINE void remap_row(const Cell* cells, int width, const Source<Pixel>& source, Pixel* out) {
  for (; width >= kCell; width -= kCell, out += kCell) remap_cell(*cells++, source, out);
  if (width == 0) return;
  std::array<Pixel, kCell> last;
  remap_cell(*cells, source, last.data());
  std::copy_n(last.data(), width, out);
}

// Names without templates, for the dispatch tables.
void gray8(const Cell* cells, int width, const Source<std::uint8_t>& source, std::uint8_t* out) {
  remap_row(cells, width, source, out);
}
void gray16(const Cell* cells, int width, const Source<std::uint16_t>& source, std::uint16_t* out) {
  remap_row(cells, width, source, out);
}
void colour8(const Cell* cells, int width, const Source<Rgb8>& source, Rgb8* out) {
  remap_row(cells, width, source, out);
}
void colour16(const Cell* cells, int width, const Source<Rgb16>& source, Rgb16* out) {
  remap_row(cells, width, source, out);
}

}  // namespace spartan::remap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::remap {

HWY_EXPORT(gray8);
HWY_EXPORT(gray16);
HWY_EXPORT(colour8);
HWY_EXPORT(colour16);

Kernels kernels_for(std::size_t target_index) {
  return {HWY_DISPATCH_TABLE(gray8)[target_index], HWY_DISPATCH_TABLE(gray16)[target_index],
          HWY_DISPATCH_TABLE(colour8)[target_index], HWY_DISPATCH_TABLE(colour16)[target_index]};
}

}  // namespace spartan::remap
#endif  // HWY_ONCE
