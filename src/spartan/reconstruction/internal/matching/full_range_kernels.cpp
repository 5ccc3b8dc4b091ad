#include "spartan/reconstruction/internal/matching/full_range_kernels.h"

#include <cstring>
#include <utility>

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/reconstruction/internal/matching/full_range_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "spartan/reconstruction/internal/matching/full_range_reference.h"

HWY_BEFORE_NAMESPACE();
namespace spartan::internal::matching::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

using namespace reference;  // NOLINT(google-build-using-namespace): no vectors on this target

#else

using FullVector = hn::ScalableTag<std::uint8_t>;
using HalfStep = hn::CappedTag<std::uint8_t, kLevelStep>;

// Calls body(d, k) for the levels k … k + Lanes(d) − 1: whole vectors, then what is left of a multiple of kLevelStep.
template <class Body>
HWY_INLINE void for_levels(int levels, Body body) {
  const FullVector full;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(FullVector()));
  int k = 0;
  for (; k + kLanes <= levels; k += kLanes) body(full, k);
  if constexpr (kLanes > kLevelStep) {
    if (k < levels) body(HalfStep(), k);
  }
}

void cost_row(const FullCostRow& r) {
  for (int x = 0; x < r.width; ++x) {
    std::uint8_t* const cost = r.cost + static_cast<std::ptrdiff_t>(x) * r.levels;
    for_levels(r.levels, [&](auto d, int k) HWY_ATTR {
      auto sum = hn::Zero(d);
      for (int p = 0; p < kPlanes; ++p) {
        const auto difference = hn::Xor(hn::Set(d, r.left[p][x]), hn::LoadU(d, r.right[p] - x + k));
        sum = hn::Add(sum, hn::PopulationCount(difference));
      }
      hn::StoreU(sum, d, cost + k);
    });
  }
}

// The smallest byte of a vector.
template <class D>
HWY_INLINE std::uint8_t smallest(D, hn::Vec<D> v) {
  const hn::Repartition<std::uint16_t, D> d16;
  const auto pairs = hn::BitCast(d16, v);
  const auto least = hn::Min(hn::And(pairs, hn::Set(d16, 0xFF)), hn::ShiftRight<8>(pairs));
  return static_cast<std::uint8_t>(hn::GetLane(hn::MinOfLanes(d16, least)));
}

// Minimum over all levels of a pixel, collected vector by vector.
struct Least {
  hn::Vec<FullVector> full;
  hn::Vec<HalfStep> half;
  HWY_INLINE void begin() {
    full = hn::Set(FullVector(), kNever);
    half = hn::Set(HalfStep(), kNever);
  }
  HWY_INLINE void add(FullVector, hn::Vec<FullVector> v) { full = hn::Min(full, v); }
  template <class D>
  HWY_INLINE void add(D, hn::Vec<D> v) {
    half = hn::Min(half, v);
  }
  HWY_INLINE std::uint8_t get(int levels) const {
    const std::uint8_t least = smallest(FullVector(), full);
    if (levels % static_cast<int>(hn::Lanes(FullVector())) == 0) return least;
    return std::min(least, smallest(HalfStep(), half));
  }
};

// C + min(L'(k) − min L', L'(k ± 1) + p1 − min L', p2)
template <class D>
HWY_INLINE hn::Vec<D> path_costs(D d, const std::uint8_t* from, hn::Vec<D> cost, hn::Vec<D> least, hn::Vec<D> p1,
                                 hn::Vec<D> p2) {
  const auto steps = hn::SaturatedAdd(hn::Min(hn::LoadU(d, from - 1), hn::LoadU(d, from + 1)), p1);
  const auto above = hn::SaturatedSub(hn::Min(hn::LoadU(d, from), steps), least);
  return hn::SaturatedAdd(cost, hn::Min(above, p2));
}

// Adds bytes to sums, or stores them.
template <class D>
HWY_INLINE void store_sum(D, hn::Vec<hn::Rebind<std::uint16_t, hn::Half<D> > > low,
                          hn::Vec<hn::Rebind<std::uint16_t, hn::Half<D> > > high, bool add, std::uint16_t* to) {
  const hn::Rebind<std::uint16_t, hn::Half<D> > d16;
  const int half = static_cast<int>(hn::Lanes(d16));
  if (add) {
    low = hn::Add(low, hn::LoadU(d16, to));
    high = hn::Add(high, hn::LoadU(d16, to + half));
  }
  hn::StoreU(low, d16, to);
  hn::StoreU(high, d16, to + half);
}

template <class D>
HWY_INLINE auto lower(D, hn::Vec<D> v) {
  const hn::Half<D> half;
  return hn::PromoteTo(hn::Rebind<std::uint16_t, hn::Half<D> >(), hn::LowerHalf(half, v));
}
template <class D>
HWY_INLINE auto upper(D, hn::Vec<D> v) {
  const hn::Half<D> half;
  return hn::PromoteTo(hn::Rebind<std::uint16_t, hn::Half<D> >(), hn::UpperHalf(half, v));
}

void vertical_row(const FullVerticalRow& r) {
  for (int x = 0; x < r.width; ++x) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * r.levels;
    Least least[3];
    for (Least& one : least) one.begin();
    for_levels(r.levels, [&](auto d, int k) HWY_ATTR {
      const auto cost = hn::LoadU(d, r.cost + at + k);
      const auto path = [&](int i) HWY_ATTR {
        const auto value = path_costs(d, r.from[i] + at + k, cost, hn::Set(d, r.from_min[i][x]), hn::Set(d, r.p1),
                                      hn::Set(d, r.p2[i][x]));
        hn::StoreU(value, d, r.to[i] + at + k);
        least[i].add(d, value);
        return value;
      };
      const auto a = path(0), b = path(1), c = path(2);
      store_sum(d, hn::Add(hn::Add(lower(d, a), lower(d, b)), lower(d, c)),
                hn::Add(hn::Add(upper(d, a), upper(d, b)), upper(d, c)), r.add, r.sum + at + k);
    });
    for (int i = 0; i < 3; ++i) r.to_min[i][x] = least[i].get(r.levels);
  }
}

// One path along the rows, from column `first` to the columns first + step …
HWY_INLINE void along_rows(const FullHorizontalRows& r, const std::uint8_t* const* p2, int first, int step) {
  const std::size_t slot = slot_bytes(r.levels);
  std::uint8_t least[kRowsAtOnce] = {};
  // L' = 0 before the first pixel, and kNever behind the range.
  for (std::size_t i = 0; i < 2 * kRowsAtOnce; ++i) {
    std::memset(r.slots + i * slot, kNever, slot);
    std::memset(r.slots + i * slot + kLevelStep, 0, static_cast<std::size_t>(r.levels));
  }
  std::size_t now = 0;
  for (int i = 0, x = first; i < r.width; ++i, x += step) {
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(x) * r.levels;
    for (std::size_t row = 0; row < kRowsAtOnce; ++row) {
      const std::uint8_t* const from = r.slots + (2 * row + now) * slot + kLevelStep;
      std::uint8_t* const to = r.slots + (2 * row + 1 - now) * slot + kLevelStep;
      Least smallest_of_row;
      smallest_of_row.begin();
      for_levels(r.levels, [&](auto d, int k) HWY_ATTR {
        const auto value = path_costs(d, from + k, hn::LoadU(d, r.cost[row] + at + k), hn::Set(d, least[row]),
                                      hn::Set(d, r.p1), hn::Set(d, p2[row][x]));
        hn::StoreU(value, d, to + k);
        smallest_of_row.add(d, value);
        store_sum(d, lower(d, value), upper(d, value), true, r.sum[row] + at + k);
      });
      least[row] = smallest_of_row.get(r.levels);
    }
    now = 1 - now;
  }
}

void horizontal_rows(const FullHorizontalRows& r) {
  along_rows(r, r.p2_from_left, 0, 1);
  along_rows(r, r.p2_from_right, r.width - 1, -1);
}

int find_winner(const std::uint16_t* sums, int levels) {
  // Not more lanes than the 16-bit levels of half a step.
  const hn::CappedTag<std::uint16_t, kLevelStep> d;
  auto least = hn::Set(d, std::uint16_t{0xFFFF});
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int k = 0; k < levels; k += lanes) least = hn::Min(least, hn::LoadU(d, sums + k));
  const auto best = hn::Set(d, hn::GetLane(hn::MinOfLanes(d, least)));
  for (int k = 0; k < levels; k += lanes) {
    const std::intptr_t found = hn::FindFirstTrue(d, hn::Eq(hn::LoadU(d, sums + k), best));
    if (found >= 0) return k + static_cast<int>(found);
  }
  return 0;
}

#endif  // HWY_TARGET == HWY_SCALAR

}  // namespace spartan::internal::matching::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::internal::matching {
namespace {

HWY_EXPORT(cost_row);
HWY_EXPORT(vertical_row);
HWY_EXPORT(horizontal_rows);
HWY_EXPORT(find_winner);

}  // namespace

FullRangeKernels full_range_kernels_for(std::size_t target_index) {
  return {HWY_DISPATCH_TABLE(cost_row)[target_index], HWY_DISPATCH_TABLE(vertical_row)[target_index],
          HWY_DISPATCH_TABLE(horizontal_rows)[target_index], HWY_DISPATCH_TABLE(find_winner)[target_index]};
}

}  // namespace spartan::internal::matching
#endif  // HWY_ONCE
