#include "spartan/sim/internal/world/noise_sum.h"

#include <algorithm>
#include <array>
#include <cstddef>

// Compiled once per instruction set: Highway includes this file again for each of them.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/sim/internal/world/noise_sum.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef SPARTAN_SIM_NOISE_SUM_POINTS
#define SPARTAN_SIM_NOISE_SUM_POINTS
namespace spartan::sim::internal {

// Points in struct-of-arrays form; `footprint` may be null.
struct NoisePoints {
  const double* x;
  const double* y;
  const double* footprint;
  double* sums;
  std::size_t count;
};

}  // namespace spartan::sim::internal
#endif

HWY_BEFORE_NAMESPACE();
namespace spartan::sim::internal::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Perlin's quintic fade 6t⁵ − 15t⁴ + 10t³.
template <class D, class V>
HWY_INLINE V fade(D d, V t) {
  const V inner = hn::Add(hn::Mul(t, hn::Sub(hn::Mul(t, hn::Set(d, 6.0)), hn::Set(d, 15.0))), hn::Set(d, 10.0));
  return hn::Mul(hn::Mul(hn::Mul(t, t), t), inner);
}

// hash_coordinates() of core: hash of two lattice coordinates, multiplied by their primes, and the seed.
template <class DU, class VU>
HWY_INLINE VU mixed(DU du, VU x, VU y, VU seed) {
  VU h = hn::Xor(hn::Xor(x, y), seed);
  h = hn::Xor(h, hn::ShiftRight<16>(h));
  h = hn::Mul(h, hn::Set(du, 0x7feb352dU));
  h = hn::Xor(h, hn::ShiftRight<15>(h));
  h = hn::Mul(h, hn::Set(du, 0x846ca68bU));
  return hn::Xor(h, hn::ShiftRight<16>(h));
}

// Contribution of one lattice corner: its gradient times the offset from it.
template <class D, class DU, class VU, class V>
HWY_INLINE V corner(D d, DU du, VU hash, V tx, V ty) {
  const hn::Rebind<std::int64_t, D> di64;
  const hn::Rebind<std::int32_t, D> di32;
  const auto at =
      hn::ShiftLeft<1>(hn::PromoteTo(di64, hn::BitCast(di32, hn::And(hash, hn::Set(du, kNoiseDirections - 1)))));
  const double* const table = noise_directions();
  const V gx = hn::GatherIndex(d, table, at), gy = hn::GatherIndex(d, table + 1, at);
  return hn::Add(hn::Mul(gx, tx), hn::Mul(gy, ty));
}

template <class D, class V>
HWY_INLINE V octave_value(D d, const Octave& o, V x, V y) {
  const hn::Rebind<std::int32_t, D> di;
  const hn::Rebind<std::uint32_t, D> du;
  const V c = hn::Set(d, o.cosine), s = hn::Set(d, o.sine), f = hn::Set(d, o.frequency), one = hn::Set(d, 1.0);
  const V lx = hn::Add(hn::Mul(hn::Sub(hn::Mul(c, x), hn::Mul(s, y)), f), hn::Set(d, o.shift_x));
  const V ly = hn::Add(hn::Mul(hn::Add(hn::Mul(s, x), hn::Mul(c, y)), f), hn::Set(d, o.shift_y));
  const V fx = hn::Floor(lx), fy = hn::Floor(ly);
  const V tx = hn::Sub(lx, fx), ty = hn::Sub(ly, fy);
  const auto kx = hn::Set(du, 0x8da6b343U), ky = hn::Set(du, 0xd8163841U), seed = hn::Set(du, o.seed);
  const auto x0 = hn::Mul(hn::BitCast(du, hn::DemoteTo(di, fx)), kx),
             y0 = hn::Mul(hn::BitCast(du, hn::DemoteTo(di, fy)), ky);
  const auto x1 = hn::Add(x0, kx), y1 = hn::Add(y0, ky);
  const V n00 = corner(d, du, mixed(du, x0, y0, seed), tx, ty);
  const V n10 = corner(d, du, mixed(du, x1, y0, seed), hn::Sub(tx, one), ty);
  const V n01 = corner(d, du, mixed(du, x0, y1, seed), tx, hn::Sub(ty, one));
  const V n11 = corner(d, du, mixed(du, x1, y1, seed), hn::Sub(tx, one), hn::Sub(ty, one));
  const V u = fade(d, tx), v = fade(d, ty);
  const V top = hn::Add(n00, hn::Mul(u, hn::Sub(n10, n00)));
  const V bottom = hn::Add(n01, hn::Mul(u, hn::Sub(n11, n01)));
  return hn::Mul(hn::Set(d, o.amplitude), hn::Add(top, hn::Mul(v, hn::Sub(bottom, top))));
}

template <class D>
HWY_INLINE void add_block(D d, std::span<const Octave> octaves, const NoisePoints& p, std::size_t at) {
  const auto x = hn::LoadU(d, p.x + at), y = hn::LoadU(d, p.y + at);
  auto sum = hn::LoadU(d, p.sums + at);
  if (p.footprint == nullptr) {
    for (const Octave& o : octaves) sum = hn::Add(sum, octave_value(d, o, x, y));
  } else {
    const auto footprint = hn::LoadU(d, p.footprint + at);
    for (const Octave& o : octaves) {
      const auto ratio = hn::Sub(hn::Div(hn::Set(d, o.size), footprint), hn::Set(d, 1.0));
      const auto weight = hn::Min(hn::Max(ratio, hn::Zero(d)), hn::Set(d, 1.0));
      if (hn::AllTrue(d, hn::Eq(weight, hn::Zero(d)))) break;  // octaves are in order of decreasing size
      sum = hn::Add(sum, hn::Mul(weight, octave_value(d, o, x, y)));
    }
  }
  hn::StoreU(sum, d, p.sums + at);
}

void add_noise(std::span<const Octave> octaves, const NoisePoints& p) {
  const hn::CappedTag<double, 8> d;
  const std::size_t lanes = hn::Lanes(d);
  std::size_t at = 0;
  for (; at + lanes <= p.count; at += lanes) add_block(d, octaves, p, at);
  const hn::CappedTag<double, 1> one;
  for (; at < p.count; ++at) add_block(one, octaves, p, at);
}

}  // namespace spartan::sim::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::sim::internal {

HWY_EXPORT(add_noise);

NoiseSum::NoiseSum(std::vector<Octave> octaves) : octaves_(std::move(octaves)) {}

void NoiseSum::add_to(std::span<double> sums, std::span<const double> x, std::span<const double> y,
                      std::span<const double> footprint_m) const {
  HWY_DYNAMIC_DISPATCH(add_noise)
  (octaves_, {x.data(), y.data(), footprint_m.empty() ? nullptr : footprint_m.data(), sums.data(), sums.size()});
}

double NoiseSum::value(double x, double y) const {
  double sum = 0;
  for (const Octave& octave : octaves_) sum += octave.value(x, y);
  return sum;
}

}  // namespace spartan::sim::internal
#endif
