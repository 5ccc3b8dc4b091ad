#include "spartan/reconstruction/internal/sgm_kernels.h"

#include <array>
#include <cstring>

#include "spartan/reconstruction/internal/sgm_reference.h"

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/reconstruction/internal/sgm_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spartan::internal::sgm::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR

using namespace reference;  // NOLINT(google-build-using-namespace): no vectors on this target

#else

template <class D>
void census_block(D d, const CensusRow& r, int x) {
  const auto centre = hn::LoadU(d, r.rows[3] + x);
  for (int p = 0; p < kPlanes; ++p) {
    auto plane = hn::Zero(d);
    for (int b = 0; b < 8 && 8 * p + b < kCensusBits; ++b) {
      const Neighbour n = census_neighbour(8 * p + b);
      const auto darker = hn::Lt(hn::LoadU(d, r.rows[n.row] + x + n.column), centre);
      plane = hn::Or(plane, hn::IfThenElseZero(darker, hn::Set(d, static_cast<std::uint8_t>(1U << b))));
    }
    hn::StoreU(plane, d, r.planes[p] + x);
  }
}

void census_row(const CensusRow& r) {
  const hn::ScalableTag<std::uint8_t> d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  int x = 0;
  for (; x + lanes <= r.width; x += lanes) census_block(d, r, x);
  // The last block overlaps the one before; images narrower than a vector are processed pixel by pixel.
  if (x < r.width && r.width >= lanes) return census_block(d, r, r.width - lanes);
  const hn::CappedTag<std::uint8_t, 1> one;
  for (; x < r.width; ++x) census_block(one, r, x);
}

template <class D>
void cost_row_with(D d, const CostRow& r) {
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int x = 0; x < r.width; ++x) {
    std::uint8_t* const cost = r.cost + static_cast<std::ptrdiff_t>(x) * r.padded;
    for (int k = 0; k < r.padded; k += lanes) {
      auto sum = hn::Zero(d);
      for (int p = 0; p < kPlanes; ++p) {
        const auto difference = hn::Xor(hn::Set(d, r.left[p][x]), hn::LoadU(d, r.right[p] - x + k));
        sum = hn::Add(sum, hn::PopulationCount(difference));
      }
      hn::StoreU(sum, d, cost + k);
    }
  }
}

template <class D>
HWY_INLINE std::uint8_t smallest(D, hn::Vec<D> v) {
  // Horizontal minimum of bytes: the smaller of each pair, then the minimum of the 16-bit lanes.
  const hn::Repartition<std::uint16_t, D> d16;
  const auto pairs = hn::BitCast(d16, v);
  const auto low = hn::And(pairs, hn::Set(d16, 0xFF));
  const auto least = hn::Min(low, hn::ShiftRight<8>(pairs));
  return static_cast<std::uint8_t>(hn::GetLane(hn::MinOfLanes(d16, least)));
}

template <class D>
PathMinima pixel_paths_with(D d, const PixelPaths& p) {
  const hn::Rebind<std::uint16_t, hn::Half<D> > d16;
  const hn::Half<D> half;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto p1 = hn::Set(d, p.p1);
  const auto from_min0 = hn::Set(d, p.from_min[0]), from_min1 = hn::Set(d, p.from_min[1]);
  const auto from_min2 = hn::Set(d, p.from_min[2]), from_min3 = hn::Set(d, p.from_min[3]);
  const auto jump0 = hn::Set(d, p.p2[0]), jump1 = hn::Set(d, p.p2[1]);
  const auto jump2 = hn::Set(d, p.p2[2]), jump3 = hn::Set(d, p.p2[3]);
  auto min0 = hn::Set(d, kNever), min1 = min0, min2 = min0, min3 = min0;
  // Slots are updated in place: L'(d − 1) of a block is loaded before the preceding block is overwritten.
  auto below0 = hn::LoadU(d, p.from[0] - 1), below1 = hn::LoadU(d, p.from[1] - 1);
  auto below2 = hn::LoadU(d, p.from[2] - 1), below3 = hn::LoadU(d, p.from[3] - 1);

  const auto path = [&](int r, int k, auto cost, auto& below, auto from_min, auto jump, auto& least) HWY_ATTR {
    const std::uint8_t* const from = p.from[r] + k;
    const auto here = hn::Load(d, from);
    const auto steps = hn::SaturatedAdd(hn::Min(below, hn::LoadU(d, from + 1)), p1);
    below = hn::LoadU(d, from + lanes - 1);
    const auto from_least = hn::SaturatedSub(hn::Min(here, steps), from_min);
    const auto value = hn::SaturatedAdd(cost, hn::Min(from_least, jump));
    hn::Store(value, d, p.to[r] + k);
    least = hn::Min(least, value);
    return value;
  };
  for (int k = 0; k < p.padded; k += lanes) {
    const auto cost = hn::LoadU(d, p.cost + k);
    const auto v0 = path(0, k, cost, below0, from_min0, jump0, min0);
    const auto v1 = path(1, k, cost, below1, from_min1, jump1, min1);
    const auto v2 = path(2, k, cost, below2, from_min2, jump2, min2);
    const auto v3 = path(3, k, cost, below3, from_min3, jump3, min3);
    auto low =
        hn::Add(hn::Add(hn::PromoteTo(d16, hn::LowerHalf(half, v0)), hn::PromoteTo(d16, hn::LowerHalf(half, v1))),
                hn::Add(hn::PromoteTo(d16, hn::LowerHalf(half, v2)), hn::PromoteTo(d16, hn::LowerHalf(half, v3))));
    auto high =
        hn::Add(hn::Add(hn::PromoteTo(d16, hn::UpperHalf(half, v0)), hn::PromoteTo(d16, hn::UpperHalf(half, v1))),
                hn::Add(hn::PromoteTo(d16, hn::UpperHalf(half, v2)), hn::PromoteTo(d16, hn::UpperHalf(half, v3))));
    if (p.add != nullptr) {
      low = hn::Add(low, hn::LoadU(d16, p.add + k));
      high = hn::Add(high, hn::LoadU(d16, p.add + k + lanes / 2));
    }
    hn::StoreU(low, d16, p.sum + k);
    hn::StoreU(high, d16, p.sum + k + lanes / 2);
  }
  return {{smallest(d, min0), smallest(d, min1), smallest(d, min2), smallest(d, min3)}};
}

template <class D>
HWY_INLINE std::uint16_t smallest_sum(D d, const std::uint16_t* sums, int padded) {
  auto least = hn::Set(d, std::uint16_t{0xFFFF});
  for (int k = 0; k < padded; k += static_cast<int>(hn::Lanes(d))) least = hn::Min(least, hn::LoadU(d, sums + k));
  return hn::GetLane(hn::MinOfLanes(d, least));
}

template <class D>
int find_winner_with(D d, const std::uint16_t* sums, int padded) {
  const auto best = hn::Set(d, smallest_sum(d, sums, padded));
  for (int k = 0; k < padded; k += static_cast<int>(hn::Lanes(d))) {
    const std::intptr_t found = hn::FindFirstTrue(d, hn::Eq(hn::LoadU(d, sums + k), best));
    if (found >= 0) return k + static_cast<int>(found);
  }
  return 0;
}

// `padded` is a multiple of 32: uses the widest vectors that divide it.
template <class Function>
HWY_INLINE auto with_widest_bytes(int padded, Function function) {
  const hn::ScalableTag<std::uint8_t> full;
  if (padded % static_cast<int>(hn::Lanes(full)) == 0) return function(full);
  return function(hn::CappedTag<std::uint8_t, 32>());
}

void cost_row(const CostRow& r) {
  with_widest_bytes(r.padded, [&](auto d) HWY_ATTR { cost_row_with(d, r); });
}
PathMinima pixel_paths(const PixelPaths& p) {
  return with_widest_bytes(p.padded, [&](auto d) HWY_ATTR { return pixel_paths_with(d, p); });
}
int find_winner(const std::uint16_t* sums, int padded) {
  return find_winner_with(hn::ScalableTag<std::uint16_t>(), sums, padded);
}
#endif  // HWY_TARGET == HWY_SCALAR

}  // namespace spartan::internal::sgm::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::internal::sgm {

HWY_EXPORT(census_row);
HWY_EXPORT(cost_row);
HWY_EXPORT(pixel_paths);
HWY_EXPORT(find_winner);

Kernels kernels_for(std::size_t target_index) {
  return {HWY_DISPATCH_TABLE(census_row)[target_index], HWY_DISPATCH_TABLE(cost_row)[target_index],
          HWY_DISPATCH_TABLE(pixel_paths)[target_index], HWY_DISPATCH_TABLE(find_winner)[target_index]};
}

}  // namespace spartan::internal::sgm
#endif  // HWY_ONCE
