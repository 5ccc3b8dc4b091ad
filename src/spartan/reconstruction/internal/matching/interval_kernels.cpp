#include "spartan/reconstruction/internal/matching/interval_kernels.h"

#include <algorithm>
#include <cstring>
#include <type_traits>

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/reconstruction/internal/matching/interval_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "spartan/reconstruction/internal/matching/interval_reference.h"

HWY_BEFORE_NAMESPACE();
namespace spartan::internal::matching::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

using namespace reference;  // NOLINT(google-build-using-namespace): no vectors on this target

#else

using Bytes = hn::ScalableTag<std::uint8_t>;
using Words = hn::Repartition<std::uint16_t, Bytes>;
using Block = hn::FixedTag<std::uint8_t, 16>;
using WordBlock = hn::FixedTag<std::uint16_t, 8>;
using ByteVector = hn::Vec<Bytes>;
using WordVector = hn::Vec<Words>;

constexpr int kVectorBytes = static_cast<int>(hn::MaxLanes(Bytes()));
constexpr int kVectors = kVectorBytes >= kLevels ? 1 : 2;  // of one step
constexpr int kStepBytes = kVectors * kVectorBytes;
constexpr int kStepPixels = kStepBytes / kLevels;  // 1, or 2 with 64-byte vectors

// A constant of 16 bytes in every block.
HWY_INLINE ByteVector in_every_block(const std::uint8_t* bytes) {
  return hn::LoadDup128(Bytes(), bytes);
}

alignas(16) constexpr std::uint8_t kFirstOfBlock[16] = {kNever};
alignas(16) constexpr std::uint8_t kLastOfBlock[16] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, kNever};
alignas(16) constexpr std::uint8_t kSwapBytes[16] = {1, 0, 3, 2, 5, 4, 7, 6, 9, 8, 11, 10, 13, 12, 15, 14};
alignas(16) constexpr std::uint8_t kSwapPairs[16] = {2, 3, 0, 1, 6, 7, 4, 5, 10, 11, 8, 9, 14, 15, 12, 13};
alignas(16) constexpr std::uint8_t kCounting[16] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};

// All levels of the pixels of one step.
struct Levels {
  ByteVector v[kVectors];
};

HWY_INLINE Levels load(const std::uint8_t* bytes) {
  Levels levels;
  for (int i = 0; i < kVectors; ++i) levels.v[i] = hn::LoadU(Bytes(), bytes + i * kVectorBytes);
  return levels;
}

HWY_INLINE void store(const Levels& levels, std::uint8_t* bytes) {
  for (int i = 0; i < kVectors; ++i) hn::StoreU(levels.v[i], Bytes(), bytes + i * kVectorBytes);
}

// The smallest level of each pixel, in all its levels.
HWY_INLINE Levels smallest(const Levels& levels) {
  const Bytes d;
  ByteVector v = levels.v[0];
  if constexpr (kVectors == 2) v = hn::Min(v, levels.v[1]);
  v = hn::Min(v, hn::BitCast(d, hn::Shuffle01(hn::BitCast(hn::Repartition<std::uint64_t, Bytes>(), v))));
  v = hn::Min(v, hn::BitCast(d, hn::Shuffle2301(hn::BitCast(hn::Repartition<std::uint32_t, Bytes>(), v))));
  v = hn::Min(v, hn::TableLookupBytes(v, in_every_block(kSwapPairs)));
  v = hn::Min(v, hn::TableLookupBytes(v, in_every_block(kSwapBytes)));
  if constexpr (kVectors == 1) v = hn::Min(v, hn::SwapAdjacentBlocks(v));
  Levels result;
  for (ByteVector& of_step : result.v) of_step = v;
  return result;
}

// One value per pixel of a step, in all levels of the pixel.
HWY_INLINE ByteVector per_pixel(const std::uint8_t* values) {
  const Bytes d;
  if constexpr (kStepPixels == 1) {
    return hn::Set(d, values[0]);
  } else {
    std::uint16_t both;
    std::memcpy(&both, values, sizeof both);
    const auto blocks = hn::BitCast(d, hn::Set(Words(), both));
    // Byte 0 in the two blocks of the first pixel, byte 1 in those of the second.
    const auto second = hn::BitCast(d, hn::Set(hn::Repartition<std::uint64_t, Bytes>(), 0x0101010101010101U));
    return hn::TableLookupBytes(blocks, hn::ConcatUpperLower(d, second, hn::Zero(d)));
  }
}

// min(L'(d), L'(d − 1) + p1, L'(d + 1) + p1, p2) for L' with a minimum of 0.
HWY_INLINE ByteVector step(ByteVector before, ByteVector p1, ByteVector p2) {
  const Bytes d;
  const auto lower = hn::Or(hn::ShiftLeftBytes<1>(d, before), in_every_block(kFirstOfBlock));
  const auto upper = hn::Or(hn::ShiftRightBytes<1>(d, before), in_every_block(kLastOfBlock));
  const auto neighbour = hn::SaturatedAdd(hn::Min(lower, upper), p1);
  return hn::Min(hn::Min(before, neighbour), p2);
}

HWY_INLINE WordVector even(ByteVector v) {
  return hn::And(hn::BitCast(Words(), v), hn::Set(Words(), std::uint16_t{0xFF}));
}
HWY_INLINE WordVector odd(ByteVector v) {
  return hn::ShiftRight<8>(hn::BitCast(Words(), v));
}

// Sums of the pixels of a step, in the order of sum_index().
struct Sums {
  WordVector even[kVectors], odd[kVectors];
};

HWY_INLINE void clear(Sums& sums) {
  for (int i = 0; i < kVectors; ++i) sums.even[i] = sums.odd[i] = hn::Zero(Words());
}
HWY_INLINE void add(const Levels& levels, Sums& sums) {
  for (int i = 0; i < kVectors; ++i) {
    sums.even[i] = hn::Add(sums.even[i], even(levels.v[i]));
    sums.odd[i] = hn::Add(sums.odd[i], odd(levels.v[i]));
  }
}
// `to` holds 2 · kInterval sums per pixel.
HWY_INLINE void store(const Sums& sums, bool add, std::uint16_t* to) {
  const Words d;
  constexpr int kLanes = kVectorBytes / 2;
  const auto put = [&](WordVector v, std::uint16_t* at)
                       HWY_ATTR { hn::StoreU(add ? hn::Add(v, hn::LoadU(d, at)) : v, d, at); };
  if constexpr (kStepPixels == 2) {
    put(hn::ConcatLowerLower(d, sums.odd[0], sums.even[0]), to);
    put(hn::ConcatUpperUpper(d, sums.odd[0], sums.even[0]), to + kLanes);
  } else {
    for (int i = 0; i < kVectors; ++i) {
      put(sums.even[i], to + i * kLanes);
      put(sums.odd[i], to + kInterval + i * kLanes);
    }
  }
}

// ---------------------------------------------------------------------------------------------------------------------

// Bit b of plane p is set where its neighbour is darker than the centre. A template, so that offsets are constants.
template <std::size_t p, std::size_t b>
HWY_INLINE ByteVector census_bit(const CensusRow& r, int x, ByteVector centre) {
  const Bytes d;
  constexpr Neighbour n = kCensusNeighbours[8 * p + b];
  const auto darker = hn::Lt(hn::LoadU(d, r.rows[n.row] + x + n.column), centre);
  return hn::IfThenElseZero(darker, hn::Set(d, static_cast<std::uint8_t>(1U << b)));
}
template <std::size_t p>
HWY_INLINE void census_plane(const CensusRow& r, int x, ByteVector centre) {
  const auto pair = [&](auto low, auto high) HWY_ATTR { return hn::Or(low, high); };
  const auto bits = pair(pair(pair(census_bit<p, 0>(r, x, centre), census_bit<p, 1>(r, x, centre)),
                              pair(census_bit<p, 2>(r, x, centre), census_bit<p, 3>(r, x, centre))),
                         pair(pair(census_bit<p, 4>(r, x, centre), census_bit<p, 5>(r, x, centre)),
                              pair(census_bit<p, 6>(r, x, centre), census_bit<p, 7>(r, x, centre))));
  hn::StoreU(bits, Bytes(), r.planes[p] + x);
}

// Rows are readable and writable for a vector behind the last column.
void census_row(const CensusRow& r) {
  static_assert(kPlanes == 4);
  for (int x = 0; x < r.width; x += kVectorBytes) {
    const auto centre = hn::LoadU(Bytes(), r.rows[3] + x);
    census_plane<0>(r, x, centre);
    census_plane<1>(r, x, centre);
    census_plane<2>(r, x, centre);
    census_plane<3>(r, x, centre);
  }
}

// Hamming distances of the bytes of two signature planes, of 16 disparities or of both intervals.
template <class D>
HWY_INLINE hn::Vec<D> distances(D d, std::uint8_t left, hn::Vec<D> right) {
  return hn::PopulationCount(hn::Xor(hn::Set(d, left), right));
}

// Costs of one interval, those of disparities d > x replaced.
HWY_INLINE hn::Vec<Block> within_view(hn::Vec<Block> cost, int x, int first, hn::Vec<Block> out_of_view) {
  const Block d;
  const auto inside = hn::Set(d, static_cast<std::uint8_t>(std::clamp(x + 1 - first, 0, kInterval)));
  return hn::IfThenElse(hn::Lt(hn::Load(d, kCounting), inside), cost, out_of_view);
}

template <class Step>
HWY_INLINE void costs_of_pixel(Step, const CostRow& r, int x, std::uint8_t* cost) {
  const Block d;
  const int first_start = r.first[x], second_start = r.second[x];
  auto first = hn::Zero(d), second = first;
  if constexpr (Step::value == 1) {
    const hn::Repartition<std::uint8_t, hn::FixedTag<std::uint8_t, kLevels * Step::value> > both;
    auto sum = hn::Zero(both);
    for (int p = 0; p < kPlanes; ++p) {
      const std::uint8_t* const right = r.right[p] - x;
      const auto signatures = hn::Combine(both, hn::LoadU(d, right + second_start), hn::LoadU(d, right + first_start));
      sum = hn::Add(sum, distances(both, r.left[p][x], signatures));
    }
    if (second_start + kInterval - 1 <= x) return hn::StoreU(sum, both, cost);
    first = hn::LowerHalf(d, sum);
    second = hn::UpperHalf(d, sum);
  } else {
    for (int p = 0; p < kPlanes; ++p) {
      const std::uint8_t* const right = r.right[p] - x;
      first = hn::Add(first, distances(d, r.left[p][x], hn::LoadU(d, right + first_start)));
      second = hn::Add(second, distances(d, r.left[p][x], hn::LoadU(d, right + second_start)));
    }
  }
  const auto out_of_view = hn::Set(d, r.out_of_view);
  hn::StoreU(within_view(first, x, first_start, out_of_view), d, cost);
  hn::StoreU(within_view(second, x, second_start, out_of_view), d, cost + kInterval);
}

void cost_row(const CostRow& r) {
  for (int x = 0; x < r.width; ++x) {
    costs_of_pixel(std::integral_constant<int, kVectors>(), r, x, r.cost + static_cast<std::ptrdiff_t>(x) * kLevels);
  }
}

// P2 of the gray-level change between two rows of pixels.
void p2_row(const P2Row& r) {
  const Bytes d;
  const auto table = in_every_block(r.table);
  for (int x = 0; x < r.width; x += kVectorBytes) {
    const auto here = hn::LoadU(d, r.here + x), before = hn::LoadU(d, r.before + x);
    const auto change = hn::Sub(hn::Max(here, before), hn::Min(here, before));
    const auto bin =
        hn::And(hn::BitCast(d, hn::ShiftRight<2>(hn::BitCast(Words(), change))), hn::Set(d, std::uint8_t{63}));
    hn::StoreU(hn::TableLookupBytes(table, hn::Min(bin, hn::Set(d, std::uint8_t{15}))), d, r.p2 + x);
  }
}

void vertical_row(const VerticalRow& r) {
  const auto p1 = hn::Set(Bytes(), r.p1);
  for (int x = 0; x < r.width; x += kStepPixels) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * kLevels;
    const Levels cost = load(r.cost + at);
    Sums sums;
    clear(sums);
    for (int path = 0; path < 3; ++path) {
      Levels levels = load(r.from[path] + at);
      const auto p2 = per_pixel(r.p2[path] + x);
      for (int i = 0; i < kVectors; ++i) levels.v[i] = hn::SaturatedAdd(step(levels.v[i], p1, p2), cost.v[i]);
      add(levels, sums);
      const Levels least = smallest(levels);
      for (int i = 0; i < kVectors; ++i) levels.v[i] = hn::Sub(levels.v[i], least.v[i]);
      store(levels, r.to[path] + at);
    }
    store(sums, r.add, r.sum + at);
  }
}

// Bytes of a block that a transition reads, for a new start that is `shift` above the old one: level k of the new
// interval is level k + shift of the old one. `outside` is kNever where there is no such level.
struct Lookup {
  hn::Vec<Block> from, outside;
};
HWY_INLINE Lookup lookup(int shift) {
  const Block d;
  const auto at = hn::Add(hn::Load(d, kCounting), hn::Set(d, static_cast<std::uint8_t>(std::clamp(shift, -16, 16))));
  const auto inside = hn::Lt(at, hn::Set(d, std::uint8_t{kInterval}));
  return {hn::And(at, hn::Set(d, std::uint8_t{15})), hn::IfThenElse(inside, hn::Zero(d), hn::Set(d, kNever))};
}
HWY_INLINE hn::Vec<Block> moved(const Lookup& by, hn::Vec<Block> costs) {
  return hn::Or(hn::TableLookupBytes(costs, by.from), by.outside);
}

struct Lookups {
  Lookup first_first, first_second, second_first, second_second;
};
HWY_INLINE Lookups lookups(const Transition& t) {
  return {lookup(t.first_first), lookup(t.first_second), lookup(t.second_first), lookup(t.second_second)};
}
// Re-expresses the path costs of one pixel.
HWY_INLINE void move(const Lookups& by, std::uint8_t* costs) {
  const Block d;
  const auto first = hn::LoadU(d, costs), second = hn::LoadU(d, costs + kInterval);
  hn::StoreU(hn::Min(moved(by.first_first, first), moved(by.first_second, second)), d, costs);
  hn::StoreU(hn::Min(moved(by.second_first, first), moved(by.second_second, second)), d, costs + kInterval);
}

void apply(const TransitionRun& run) {
  if (run.transition.none()) return;
  const Lookups by = lookups(run.transition);
  for (int i = 0; i < run.count; ++i) move(by, run.costs + static_cast<std::ptrdiff_t>(i) * kLevels);
}

constexpr int kGroups = kRowsAtOnce / kStepPixels;  // rows of one step form a group

// The same pixel of all rows of a group.
HWY_INLINE Levels load_rows(const std::uint8_t* const* rows, std::ptrdiff_t at) {
  if constexpr (kStepPixels == 1) {
    return load(rows[0] + at);
  } else {
    const hn::Half<Bytes> half;
    return {{hn::Combine(Bytes(), hn::LoadU(half, rows[1] + at), hn::LoadU(half, rows[0] + at))}};
  }
}
HWY_INLINE ByteVector per_row(const std::uint8_t* const* rows, int x) {
  std::uint8_t values[kStepPixels];
  for (int i = 0; i < kStepPixels; ++i) values[i] = rows[i][x];
  return per_pixel(values);
}
HWY_INLINE void add_to_rows(const Sums& sums, std::ptrdiff_t at, std::uint16_t* const* rows) {
  const Words d;
  const auto put = [&](WordVector v, std::uint16_t* to) HWY_ATTR { hn::StoreU(hn::Add(v, hn::LoadU(d, to)), d, to); };
  if constexpr (kStepPixels == 1) {
    store(sums, true, rows[0] + at);
  } else {
    put(hn::ConcatLowerLower(d, sums.odd[0], sums.even[0]), rows[0] + at);
    put(hn::ConcatUpperUpper(d, sums.odd[0], sums.even[0]), rows[1] + at);
  }
}

// Path costs of all rows at the column where the paths have come to.
struct RowPaths {
  Levels group[kGroups];
  alignas(64) std::uint8_t bytes[kGroups][kStepBytes];

  HWY_INLINE void apply(const Transition& transition) {
    if (transition.none()) return;
    const Lookups by = lookups(transition);
    for (int g = 0; g < kGroups; ++g) store(group[g], bytes[g]);
    for (std::uint8_t* const step : bytes) {
      for (int i = 0; i < kStepPixels; ++i) move(by, step + i * kLevels);
    }
    for (int g = 0; g < kGroups; ++g) group[g] = load(bytes[g]);
  }

  HWY_INLINE void advance(const HorizontalRows& r, const std::uint8_t* const* p2, int x) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * kLevels;
    const auto p1 = hn::Set(Bytes(), r.p1);
    for (int g = 0; g < kGroups; ++g) {
      const int row = g * kStepPixels;
      const Levels cost = load_rows(r.cost + row, at);
      const auto jump = per_row(p2 + row, x);
      Levels& levels = group[g];
      for (int i = 0; i < kVectors; ++i) levels.v[i] = hn::SaturatedAdd(step(levels.v[i], p1, jump), cost.v[i]);
      Sums sums;
      clear(sums);
      add(levels, sums);
      add_to_rows(sums, at, r.sum + row);
      const Levels least = smallest(levels);
      for (int i = 0; i < kVectors; ++i) levels.v[i] = hn::Sub(levels.v[i], least.v[i]);
    }
  }
};

void horizontal_rows(const HorizontalRows& r) {
  RowPaths paths;
  for (Levels& levels : paths.group) {
    for (ByteVector& v : levels.v) v = hn::Zero(Bytes());
  }
  for (int i = 0; i < r.run_count; ++i) {
    if (i > 0) paths.apply(r.runs[i].from_left);
    for (int x = r.runs[i].from; x < r.runs[i].to; ++x) paths.advance(r, r.p2_from_left, x);
  }
  for (Levels& levels : paths.group) {
    for (ByteVector& v : levels.v) v = hn::Zero(Bytes());
  }
  for (int i = r.run_count - 1; i >= 0; --i) {
    if (i + 1 < r.run_count) paths.apply(r.runs[i].from_right);
    for (int x = r.runs[i].to - 1; x >= r.runs[i].from; --x) paths.advance(r, r.p2_from_right, x);
  }
}

// Cost · 32 + level of all levels, 8 at a time in the order of sum_index().
alignas(16) constexpr std::uint16_t kLevelOfSum[kLevels] = {0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30,
                                                            1, 3, 5, 7, 9, 11, 13, 15, 17, 19, 21, 23, 25, 27, 29, 31};

HWY_INLINE void lower_to(hn::Vec<WordBlock> keys, std::uint16_t* at) {
  const WordBlock d;
  hn::StoreU(hn::Min(keys, hn::LoadU(d, at)), d, at);
}

HWY_INLINE void select_pixel(const SelectRow& r, int x) {
  const WordBlock d;
  const std::uint16_t* const sum = r.sum + static_cast<std::ptrdiff_t>(x) * kLevels;
  hn::Vec<WordBlock> shifted[4];
  auto best = hn::Set(d, std::uint16_t{0xFFFF});
  for (int i = 0; i < 4; ++i) {
    shifted[i] = hn::ShiftLeft<5>(hn::LoadU(d, sum + 8 * i));
    best = hn::Min(best, hn::Or(shifted[i], hn::Load(d, kLevelOfSum + 8 * i)));
  }
  r.winner[x] = hn::GetLane(hn::MinOfLanes(d, best));
  if (r.right_best == nullptr) return;
  // Blocks 0 and 2 hold the even and odd levels of the first interval, 1 and 3 those of the second.
  const auto tag = hn::Set(d, static_cast<std::uint16_t>(x & 31));
  std::uint16_t* const first = r.right_best + r.first[x] - x;
  std::uint16_t* const second = r.right_best + r.second[x] - x;
  lower_to(hn::Or(hn::InterleaveLower(d, shifted[0], shifted[2]), tag), first);
  lower_to(hn::Or(hn::InterleaveUpper(d, shifted[0], shifted[2]), tag), first + 8);
  lower_to(hn::Or(hn::InterleaveLower(d, shifted[1], shifted[3]), tag), second);
  lower_to(hn::Or(hn::InterleaveUpper(d, shifted[1], shifted[3]), tag), second + 8);
}

// Neighbouring pixels update the same right pixels: columns are taken 32 apart, so that no load waits for a store.
void select_row(const SelectRow& r) {
  constexpr int kApart = 32;
  for (int from = 0; from < std::min(kApart, r.width); ++from) {
    for (int x = from; x < r.width; x += kApart) select_pixel(r, x);
  }
}

#endif  // HWY_TARGET == HWY_SCALAR

}  // namespace spartan::internal::matching::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::internal::matching {

HWY_EXPORT(census_row);
HWY_EXPORT(cost_row);
HWY_EXPORT(p2_row);
HWY_EXPORT(vertical_row);
HWY_EXPORT(apply);
HWY_EXPORT(horizontal_rows);
HWY_EXPORT(select_row);

Kernels kernels_for(std::size_t target_index) {
  return {HWY_DISPATCH_TABLE(census_row)[target_index], HWY_DISPATCH_TABLE(cost_row)[target_index],
          HWY_DISPATCH_TABLE(p2_row)[target_index],     HWY_DISPATCH_TABLE(vertical_row)[target_index],
          HWY_DISPATCH_TABLE(apply)[target_index],      HWY_DISPATCH_TABLE(horizontal_rows)[target_index],
          HWY_DISPATCH_TABLE(select_row)[target_index]};
}

}  // namespace spartan::internal::matching
#endif  // HWY_ONCE
