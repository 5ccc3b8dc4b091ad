#include "spartan/reconstruction/internal/matching/refinement_kernels.h"

#include <limits>

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/reconstruction/internal/matching/refinement_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spartan::internal::matching::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::ScalableTag<float>;
using Ints = hn::Rebind<std::int32_t, Floats>;
using Shorts = hn::Rebind<std::int16_t, Floats>;
using FloatVector = hn::Vec<Floats>;
using IntVector = hn::Vec<Ints>;

HWY_INLINE FloatVector constant(float value) {
  return hn::Set(Floats(), value);
}
HWY_INLINE IntVector load_shorts(const std::int16_t* from) {
  return hn::PromoteTo(Ints(), hn::LoadU(Shorts(), from));
}
HWY_INLINE void store_shorts(IntVector v, std::int16_t* to) {
  hn::StoreU(hn::DemoteTo(Shorts(), v), Shorts(), to);
}

// Of nine values in three sorted columns the median is the median of the largest minimum, the median of the medians and
// the smallest maximum.
// Returns whether a lane is NaN.
template <class D>
HWY_INLINE bool median_at(D d, const MedianRow& r, int x) {
  using V = hn::Vec<D>;
  const auto median_of = [](V a, V b, V c) HWY_ATTR { return hn::Max(hn::Min(a, b), hn::Min(hn::Max(a, b), c)); };
  V low[3], middle[3], high[3];
  V sum = hn::Zero(d);
  for (int i = 0; i < 3; ++i) {
    const V a = hn::LoadU(d, r.rows[0] + x + i - 1), b = hn::LoadU(d, r.rows[1] + x + i - 1),
            c = hn::LoadU(d, r.rows[2] + x + i - 1);
    const V least = hn::Min(a, b), most = hn::Max(a, b);
    low[i] = hn::Min(least, c);
    high[i] = hn::Max(most, c);
    middle[i] = hn::Max(least, hn::Min(most, c));
    sum = hn::Add(sum, hn::Add(hn::Add(a, b), c));
  }
  const V median = median_of(hn::Max(hn::Max(low[0], low[1]), low[2]), median_of(middle[0], middle[1], middle[2]),
                             hn::Min(hn::Min(high[0], high[1]), high[2]));
  // A sum with NaN is NaN, minima and maxima need not be.
  const auto known = hn::Eq(sum, sum);
  hn::StoreU(hn::IfThenElse(known, median, sum), d, r.median + x);
  return !hn::AllTrue(d, known);
}

bool median_row(const MedianRow& r) {
  const Floats d;
  const int lanes = static_cast<int>(hn::Lanes(d)), end = r.width - 1;
  int x = 1;
  bool unknown = false;
  for (; x + lanes <= end; x += lanes) unknown |= median_at(d, r, x);
  // The last vector overlaps the one before; narrow images are processed pixel by pixel.
  if (x < end && end - 1 >= lanes) return median_at(d, r, end - lanes) || unknown;
  const hn::CappedTag<float, 1> one;
  for (; x < end; ++x) unknown |= median_at(one, r, x);
  return unknown;
}

void smooth_row(const SmoothRow& r) {
  const Floats d;
  const auto two = constant(2), tolerance = constant(2 * r.tolerance), least = constant(2 * r.least_tolerance);
  const auto sigmas = constant(2 * r.sigmas), growth = constant(r.growth), half = constant(0.5F);
  const int s = r.step;
  for (int x = 0; x < r.width; x += static_cast<int>(hn::Lanes(d))) {
    const auto centre = hn::LoadU(d, r.disparity[1] + x), own = hn::LoadU(d, r.information[1] + x);
    const auto doubled = hn::Mul(two, centre);
    const auto bound = hn::Min(tolerance, hn::Max(least, hn::Div(sigmas, hn::Sqrt(own))));
    auto weights = hn::Zero(d), changes = weights;
    const auto pair = [&](int row, int dx) HWY_ATTR {
      const int opposite = 2 - row;
      const auto change = hn::Sub(
          hn::Add(hn::LoadU(d, r.disparity[row] + x + dx), hn::LoadU(d, r.disparity[opposite] + x - dx)), doubled);
      const auto least_information =
          hn::Min(hn::LoadU(d, r.information[row] + x + dx), hn::LoadU(d, r.information[opposite] + x - dx));
      // Not where one of the disparities is NaN.
      const auto weight = hn::IfThenElseZero(hn::Lt(hn::Abs(change), bound), hn::Mul(two, least_information));
      weights = hn::Add(weights, weight);
      // 0 · NaN is NaN: a change that does not count is taken out.
      changes = hn::Add(changes, hn::IfThenElseZero(hn::Lt(hn::Abs(change), bound), hn::Mul(weight, change)));
    };
    pair(1, s);
    pair(2, 0);
    pair(2, s);
    pair(2, -s);
    const auto mean = hn::Div(hn::Mul(half, changes), hn::Add(own, weights));
    hn::StoreU(hn::Add(centre, mean), d, r.smoothed + x);
    hn::StoreU(hn::Add(own, hn::Mul(growth, weights)), d, r.smoothed_information + x);
  }
}

// Byte i of each lane as a number.
template <int i>
HWY_INLINE FloatVector byte_of(IntVector bytes) {
  return hn::ConvertTo(Floats(), hn::And(hn::ShiftRight<8 * i>(bytes), hn::Set(Ints(), 255)));
}

void warp_row(const WarpRow& r) {
  const Floats d;
  const Ints di;
  const hn::Rebind<std::uint8_t, Floats> bytes;
  const auto zero = hn::Zero(d), half = constant(0.5F);
  const auto last = constant(static_cast<float>(r.width - 2));
  for (int x = 0; x < r.width; x += static_cast<int>(hn::Lanes(d))) {
    const auto columns = hn::ConvertTo(d, hn::Iota(di, x));
    const auto source = hn::Sub(columns, hn::LoadU(d, r.disparity + x));
    const auto known = hn::And(hn::Ge(source, constant(1)), hn::Lt(source, last));  // not where it is NaN
    const auto at = hn::IfThenElse(known, source, constant(1));
    const auto cell = hn::ConvertTo(di, at);
    const auto f = hn::Sub(at, hn::ConvertTo(d, cell));
    const auto four =
        hn::GatherOffset(di, reinterpret_cast<const std::int32_t*>(r.right - 1), cell);  // bytes cell − 1 … cell + 2
    const auto p0 = byte_of<0>(four), p1 = byte_of<1>(four), p2 = byte_of<2>(four), p3 = byte_of<3>(four);
    // p1 + ½ f (a + f (b + f c)) and its derivative.
    const auto a = hn::Sub(p2, p0);
    const auto c = hn::Add(hn::Mul(constant(3), hn::Sub(p1, p2)), hn::Sub(p3, p0));
    const auto b =
        hn::Sub(hn::Add(hn::Mul(constant(2), p0), hn::Mul(constant(4), p2)), hn::Add(hn::Mul(constant(5), p1), p3));
    const auto fc = hn::Mul(f, c);
    const auto value = hn::Add(p1, hn::Mul(hn::Mul(half, f), hn::Add(a, hn::Mul(f, hn::Add(b, fc)))));
    const auto slope =
        hn::Mul(half, hn::Add(a, hn::Mul(f, hn::Add(hn::Mul(constant(2), b), hn::Mul(constant(3), fc)))));
    const auto left = [&](int dx)
                          HWY_ATTR { return hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(bytes, r.left + x + dx))); };
    const auto left_slope = hn::Mul(half, hn::Sub(left(1), left(-1)));
    const auto put = [&](FloatVector v, std::int16_t* to)
                         HWY_ATTR { store_shorts(hn::NearestInt(hn::IfThenElse(known, v, zero)), to + x); };
    put(constant(1), r.known);
    put(hn::Mul(constant(16), left(0)), r.gray);
    put(hn::Mul(constant(16), value), r.warped);
    put(hn::Mul(constant(-4), hn::Add(slope, left_slope)), r.gradient);
    put(hn::Mul(constant(-4), hn::Sub(slope, left_slope)), r.difference);
  }
}

struct FitValues {
  IntVector n, l, r, g, q;
};
HWY_INLINE FitValues load_values(const ColumnUpdate::Row& row, int x) {
  return {load_shorts(row.known + x), load_shorts(row.gray + x), load_shorts(row.warped + x),
          load_shorts(row.gradient + x), load_shorts(row.difference + x)};
}

void update_columns(const ColumnUpdate& u) {
  const Ints d;
  for (int x = 0; x < u.width; x += static_cast<int>(hn::Lanes(d))) {
    const auto none = hn::Zero(d);
    const FitValues in = u.add != nullptr ? load_values(*u.add, x) : FitValues{none, none, none, none, none};
    const FitValues out = u.subtract != nullptr ? load_values(*u.subtract, x) : FitValues{none, none, none, none, none};
    const auto change = [&](FitSum sum, IntVector by) HWY_ATTR {
      std::int32_t* const to = u.columns[sum] + x;
      hn::StoreU(hn::Add(hn::LoadU(d, to), by), d, to);
    };
    const auto product = [&](FitSum sum, IntVector a, IntVector b, IntVector minus_a, IntVector minus_b)
                             HWY_ATTR { change(sum, hn::Sub(hn::Mul(a, b), hn::Mul(minus_a, minus_b))); };
    change(kN, hn::Sub(in.n, out.n));
    change(kL, hn::Sub(in.l, out.l));
    change(kR, hn::Sub(in.r, out.r));
    change(kG, hn::Sub(in.g, out.g));
    change(kQ, hn::Sub(in.q, out.q));
    product(kLL, in.l, in.l, out.l, out.l);
    product(kLR, in.l, in.r, out.l, out.r);
    product(kRR, in.r, in.r, out.r, out.r);
    product(kLG, in.l, in.g, out.l, out.g);
    product(kRG, in.r, in.g, out.r, out.g);
    product(kGG, in.g, in.g, out.g, out.g);
    product(kQQ, in.q, in.q, out.q, out.q);
  }
}

HWY_INLINE FloatVector window_sum(const std::int32_t* column) {
  const Ints d;
  auto sum = hn::LoadU(d, column - kFitRadius);
  for (int i = 1 - kFitRadius; i <= kFitRadius; ++i) sum = hn::Add(sum, hn::LoadU(d, column + i));
  return hn::ConvertTo(Floats(), sum);
}

// A window with less variance shows nothing: clipped, or without light.
constexpr float kBlank_levels2 = 0.01F;
// Weights of 0 have no mean.
constexpr float kLeastInformation = 1e-4F;

void fit_row(const FitRow& r) {
  const Floats d;
  const hn::Rebind<std::uint8_t, Floats> bytes;
  const auto zero = hn::Zero(d);
  const auto noise2 = constant(r.noise_levels * r.noise_levels);
  const auto prior = constant(1 / (r.prior_px * r.prior_px));
  // Gains are kept near 1 where the window has less contrast than this, squared gray levels.
  const auto contrast = constant(25);
  for (int x = 0; x < r.width; x += static_cast<int>(hn::Lanes(d))) {
    const auto sum = [&](FitSum which) HWY_ATTR { return window_sum(r.columns[which] + x); };
    const auto n = hn::Max(sum(kN), constant(1));
    const auto each = hn::Div(constant(1), n);
    // Means and covariances in gray levels.
    const auto level = hn::Mul(each, constant(1.0F / 16)), slope = hn::Mul(each, constant(1.0F / 8));
    const auto ml = hn::Mul(sum(kL), level), mr = hn::Mul(sum(kR), level);
    const auto mg = hn::Mul(sum(kG), slope), mq = hn::Mul(sum(kQ), slope);
    const auto covariance = [&](FitSum which, float scale, FloatVector a, FloatVector b) HWY_ATTR {
      return hn::Sub(hn::Mul(sum(which), hn::Mul(each, constant(scale))), hn::Mul(a, b));
    };
    const auto ll = covariance(kLL, 1.0F / 256, ml, ml), lr = covariance(kLR, 1.0F / 256, ml, mr),
               rr = covariance(kRR, 1.0F / 256, mr, mr), lg = covariance(kLG, 1.0F / 128, ml, mg),
               rg = covariance(kRG, 1.0F / 128, mr, mg), gg = covariance(kGG, 1.0F / 64, mg, mg),
               qq = covariance(kQQ, 1.0F / 64, mq, mq);
    const auto gain = hn::Min(
        hn::Max(hn::Div(hn::Add(lr, contrast), hn::Add(hn::Max(rr, zero), contrast)), constant(0.6F)), constant(1.6F));
    const auto residual =
        hn::Add(hn::Sub(ll, hn::Mul(hn::Mul(constant(2), gain), lr)), hn::Mul(hn::Mul(gain, gain), rr));
    const auto s2 = hn::Max(noise2, residual);
    // g is the mean of the gradients of r and of l = G r + O.
    const auto slope_gain = hn::Div(hn::Mul(constant(2), gain), hn::Add(gain, constant(1)));
    const auto h = hn::Mul(hn::Mul(hn::Mul(slope_gain, slope_gain), n), hn::Max(gg, zero));
    const auto b = hn::Mul(hn::Mul(slope_gain, n), hn::Sub(lg, hn::Mul(gain, rg)));
    // Gradients of noise have nothing in common: cov(g_l, g_r) = var(g) − var(q) with half the difference q.
    const auto shared = hn::Mul(hn::Mul(hn::Mul(slope_gain, slope_gain), n), hn::Max(hn::Sub(gg, qq), zero));
    const auto texture = hn::Div(shared, s2);
    const auto information = hn::Add(texture, prior);
    // Too few pixels of the window are known where the fit has no freedom left.
    const auto enough = hn::Ge(n, constant(8));
    const auto blank = hn::Lt(hn::Min(ll, rr), constant(kBlank_levels2));
    const auto step = hn::Div(b, hn::Add(h, hn::Mul(s2, prior)));
    const auto bounded = hn::Max(constant(-0.7F), hn::Min(step, constant(0.7F)));
    hn::StoreU(hn::Add(hn::LoadU(d, r.disparity + x), hn::IfThenElseZero(enough, bounded)), d, r.disparity + x);
    hn::StoreU(hn::IfThenElse(blank, constant(kLeastInformation), hn::IfThenElse(enough, information, prior)), d,
               r.information + x);
    const auto correlated = hn::Ge(hn::Sub(gg, qq), hn::Mul(constant(r.least_correlation), hn::Add(gg, qq)));
    const auto textured =
        hn::IfThenElseZero(hn::And(correlated, hn::Ge(texture, constant(r.least_texture))), constant(1));
    hn::StoreU(hn::DemoteTo(bytes, hn::NearestInt(textured)), bytes, r.textured + x);
  }
}

void gradient_variance_row(const GradientVarianceRow& r) {
  const Floats d;
  for (int x = 0; x < r.width; x += static_cast<int>(hn::Lanes(d))) {
    const auto sum = [&](FitSum which) HWY_ATTR { return window_sum(r.columns[which] + x); };
    const auto each = hn::Div(constant(1), hn::Max(sum(kN), constant(1)));
    const auto variance = [&](FitSum squares, FitSum values) HWY_ATTR {
      const auto mean = hn::Mul(sum(values), hn::Mul(each, constant(1.0F / 8)));
      const auto square = hn::Mul(sum(squares), hn::Mul(each, constant(1.0F / 64)));
      return hn::Max(hn::Sub(square, hn::Mul(mean, mean)), hn::Zero(d));
    };
    hn::StoreU(variance(kGG, kG), d, r.mean + x);
    hn::StoreU(variance(kQQ, kQ), d, r.difference + x);
  }
}

void relief_row(const ReliefRow& r) {
  const Floats d;
  const auto one = constant(1);
  for (int x = 0; x < r.width; x += static_cast<int>(hn::Lanes(d))) {
    const auto doubled = hn::Mul(constant(2), hn::LoadU(d, r.disparity + x));
    const auto mean_of = [&](int i) HWY_ATTR {
      const int s = ReliefRow::kSteps[i];
      auto sum = hn::Zero(d), count = sum;
      const auto pair = [&](const float* first, const float* second) HWY_ATTR {
        const auto change = hn::Sub(hn::Add(hn::LoadU(d, first), hn::LoadU(d, second)), doubled);
        const auto known = hn::Eq(change, change);
        const auto bounded = hn::Min(hn::Abs(hn::IfThenElseZero(known, change)), constant(2));
        sum = hn::Add(sum, hn::Mul(bounded, bounded));
        count = hn::Add(count, hn::IfThenElseZero(known, one));
      };
      pair(r.disparity + x + s, r.disparity + x - s);
      pair(r.below[i] + x, r.above[i] + x);
      pair(r.below[i] + x + s, r.above[i] + x - s);
      pair(r.below[i] + x - s, r.above[i] + x + s);
      const auto none = hn::Eq(count, hn::Zero(d));
      return hn::Mul(constant(0.25F), hn::Div(hn::IfThenElse(none, one, sum), hn::Max(count, one)));
    };
    hn::StoreU(hn::Add(mean_of(0), hn::Mul(constant(0.25F), mean_of(1))), d, r.relief + x);
  }
}

// The number of the bits of a float is about its logarithm, and the float of a number about its power.
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
constexpr float kBitsPerOctave = 1 << 23;
constexpr float kBitsOfOne = 127 * kBitsPerOctave;
HWY_INLINE FloatVector about_log2(FloatVector v) {
  const auto bits = hn::ConvertTo(Floats(), hn::BitCast(Ints(), v));
  return hn::Mul(hn::Sub(bits, constant(kBitsOfOne)), constant(1 / kBitsPerOctave));
}
HWY_INLINE FloatVector about_exp2(FloatVector v) {
  const auto bits = hn::Add(hn::Mul(v, constant(kBitsPerOctave)), constant(kBitsOfOne));
  return hn::BitCast(Floats(), hn::ConvertTo(Ints(), bits));
}

constexpr float kLeastRelief_px2 = 0.01F;

void reliability_row(const ReliabilityRow& r) {
  const Floats d;
  const Ints di;
  const hn::Rebind<std::uint8_t, Floats> bytes;
  const ReliabilityModel& m = r.model;
  const auto one = constant(1);
  constexpr float kOctavesPerLogit = 1.44269504F;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int x = 0; x < r.width; x += lanes) {
    const auto information = hn::LoadU(d, r.information + x);
    const auto distance = hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(bytes, r.right_distance + x)));
    const auto relief = hn::LoadU(d, r.relief + x);
    const auto logit =
        hn::Add(hn::Add(constant(m.offset), hn::Mul(constant(m.distance), about_log2(hn::Add(one, distance)))),
                hn::Add(hn::Mul(constant(m.information), about_log2(information)),
                        hn::Mul(constant(m.relief), about_log2(hn::Add(relief, constant(kLeastRelief_px2))))));
    // p = 1 / (1 + e^−logit)
    const auto octaves = hn::Min(hn::Max(hn::Mul(logit, constant(-kOctavesPerLogit)), constant(-30)), constant(30));
    const auto percent = hn::Div(constant(100), hn::Add(one, about_exp2(octaves)));
    const auto noise_px = hn::Div(constant(m.scale), information);
    const auto unbounded = hn::Add(hn::Add(hn::Mul(noise_px, noise_px), constant(m.floor_px * m.floor_px)),
                                   hn::Mul(constant(m.relief_scale * m.relief_scale), relief));
    const auto variance = hn::Div(unbounded, hn::Add(one, hn::Mul(unbounded, constant(1 / (m.most_px * m.most_px)))));
    const auto rounded = hn::NearestInt(percent);
    hn::StoreU(hn::DemoteTo(bytes, rounded), bytes, r.outlier_percent + x);
    const auto reliable = hn::IfThenElseZero(hn::Le(hn::ConvertTo(d, rounded), constant(m.reliable_percent)),
                                             hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(bytes, r.reliable + x))));
    hn::StoreU(hn::DemoteTo(bytes, hn::NearestInt(reliable)), bytes, r.reliable + x);
    hn::StoreU(hn::Sqrt(variance), d, r.sigma + x);
    const auto disparity = hn::LoadU(d, r.disparity + x);
    const auto kept = hn::Le(hn::ConvertTo(d, rounded), constant(r.most_percent));
    hn::StoreU(hn::IfThenElse(kept, disparity, constant(kUnknown)), d, r.disparity + x);
  }
}

}  // namespace spartan::internal::matching::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::internal::matching {

HWY_EXPORT(median_row);
HWY_EXPORT(smooth_row);
HWY_EXPORT(warp_row);
HWY_EXPORT(update_columns);
HWY_EXPORT(fit_row);
HWY_EXPORT(gradient_variance_row);
HWY_EXPORT(relief_row);
HWY_EXPORT(reliability_row);

RefinementKernels refinement_kernels_for(std::size_t target_index) {
  return {HWY_DISPATCH_TABLE(median_row)[target_index], HWY_DISPATCH_TABLE(smooth_row)[target_index],
          HWY_DISPATCH_TABLE(warp_row)[target_index],   HWY_DISPATCH_TABLE(update_columns)[target_index],
          HWY_DISPATCH_TABLE(fit_row)[target_index],    HWY_DISPATCH_TABLE(gradient_variance_row)[target_index],
          HWY_DISPATCH_TABLE(relief_row)[target_index], HWY_DISPATCH_TABLE(reliability_row)[target_index]};
}

}  // namespace spartan::internal::matching
#endif  // HWY_ONCE
