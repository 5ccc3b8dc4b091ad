#include "spartan/reconstruction/internal/matching/block_kernels.h"

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/reconstruction/internal/matching/block_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spartan::internal::matching::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using PlaneBytes = hn::ScalableTag<std::uint8_t>;
using PlaneWords = hn::ScalableTag<std::uint16_t>;

void difference_row(const DifferenceRow& r) {
  const PlaneBytes d;
  const auto most = hn::Set(d, std::uint8_t{31});
  for (int x = 0; x < r.width; x += static_cast<int>(hn::Lanes(d))) {
    const auto left = hn::LoadU(d, r.left + x), right = hn::LoadU(d, r.right + x);
    const auto bounded = hn::Min(hn::Or(hn::SaturatedSub(left, right), hn::SaturatedSub(right, left)), most);
    const auto twice = hn::Add(bounded, bounded), four = hn::Add(twice, twice);
    hn::StoreU(hn::Add(four, four), d, r.difference + x);
  }
}

void average_row(const AverageRow& r) {
  const PlaneBytes d;
  for (int x = 0; x < r.width; x += static_cast<int>(hn::Lanes(d))) {
    const auto sides = hn::AverageRound(hn::LoadU(d, r.a + x), hn::LoadU(d, r.c + x));
    hn::StoreU(hn::AverageRound(sides, hn::LoadU(d, r.b + x)), d, r.average + x);
  }
}

void update_row(const PlaneUpdate& u) {
  const PlaneWords d;
  const hn::Rebind<std::uint8_t, PlaneWords> bytes;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto index = hn::Set(d, static_cast<std::uint16_t>(u.index));
  const auto last = hn::Set(d, static_cast<std::uint16_t>(u.index - 1));
  const auto none = hn::Set(d, std::uint16_t{255});
  for (int x = 0; x < u.width; x += lanes) {
    // Behind the last pixel nothing changes.
    const auto inside = hn::FirstN(d, static_cast<std::size_t>(u.width - x));
    const auto load = [&](const std::uint8_t* from) HWY_ATTR { return hn::PromoteTo(d, hn::LoadU(bytes, from + x)); };
    const auto store = [&](hn::Vec<PlaneWords> v, std::uint8_t* to) HWY_ATTR {
      hn::StoreU(hn::DemoteTo(bytes, hn::BitCast(hn::RebindToSigned<PlaneWords>(), v)), bytes, to + x);
    };
    const auto cost = load(u.cost), best = load(u.left.best), previous = load(u.left.previous);
    const auto best_index = hn::LoadU(d, u.left.index + x);
    const auto better = hn::And(inside, hn::Lt(cost, best));
    // The plane behind the best one so far: its cost, unless this one is better.
    const auto follows = hn::And(inside, hn::Eq(best_index, last));
    const auto after = hn::IfThenElse(follows, cost, load(u.left.after));
    store(hn::IfThenElse(better, none, after), u.left.after);
    store(hn::IfThenElse(better, previous, load(u.left.before)), u.left.before);
    store(hn::IfThenElse(better, cost, best), u.left.best);
    store(hn::IfThenElse(inside, cost, previous), u.left.previous);
    hn::StoreU(hn::IfThenElse(better, index, best_index), d, u.left.index + x);
    const auto right_best = load(u.right_best);
    const auto right_better = hn::And(inside, hn::Lt(cost, right_best));
    store(hn::IfThenElse(right_better, cost, right_best), u.right_best);
    hn::StoreU(hn::IfThenElse(right_better, index, hn::LoadU(d, u.right_index + x)), d, u.right_index + x);
  }
}

}  // namespace spartan::internal::matching::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::internal::matching {

HWY_EXPORT(difference_row);
HWY_EXPORT(average_row);
HWY_EXPORT(update_row);

BlockKernels block_kernels_for(std::size_t target_index) {
  return {HWY_DISPATCH_TABLE(difference_row)[target_index], HWY_DISPATCH_TABLE(average_row)[target_index],
          HWY_DISPATCH_TABLE(update_row)[target_index]};
}

}  // namespace spartan::internal::matching
#endif  // HWY_ONCE
