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

#if HWY_TARGET == HWY_SCALAR

void remap_cell(const Cell& cell, const Source& source, std::uint8_t* out) {
  for (int i = 0; i < kCell; ++i) {
    out[i] = 0;
    if (cell.kinds[i / kBlock] == kScattered || cell.codes[i] == kUnseen) continue;
    const Place corner = cell.corners[i / kBlock];
    const int y = corner.y + (cell.codes[i] >> 4);
    const std::uint8_t* const p = source.data + y * source.stride + corner.x + (cell.codes[i] & 15);
    const std::uint8_t* const q = p + (y + 1 < source.height ? source.stride : 0);
    out[i] = static_cast<std::uint8_t>(interpolate(p[0], p[1], q[0], q[1], cell.part_x[i], cell.part_y[i]));
  }
}

#else

/// 16 bytes for each block of the vector, all `step` rows below its corner.
template <class D>
HWY_INLINE hn::Vec<D> load_rows(D d, const Place* corners, int step, const Source& s) {
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
HWY_INLINE void remap_blocks(D d, const Cell& cell, const Source& source, int block, int rows, std::uint8_t* out) {
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

HWY_INLINE void remap_cell(const Cell& cell, const Source& source, std::uint8_t* out) {
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

#endif  // HWY_TARGET == HWY_SCALAR

void remap_row(const Cell* cells, int width, const Source& source, std::uint8_t* out) {
  for (; width >= kCell; width -= kCell, out += kCell) remap_cell(*cells++, source, out);
  if (width == 0) return;
  std::array<std::uint8_t, kCell> last;
  remap_cell(*cells, source, last.data());
  std::copy_n(last.data(), width, out);
}

}  // namespace spartan::remap::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::remap {

HWY_EXPORT(remap_row);

RowKernel row_kernel_for(std::size_t target_index) {
  return HWY_DISPATCH_TABLE(remap_row)[target_index];
}

}  // namespace spartan::remap
#endif  // HWY_ONCE
