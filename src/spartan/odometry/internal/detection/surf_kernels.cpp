#include "spartan/odometry/internal/detection/surf_kernels.h"

#include <cmath>

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/odometry/internal/detection/surf_kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace spartan::internal::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Sums = hn::CappedTag<std::uint32_t, kSurfPadding>;
using Signed = hn::RebindToSigned<Sums>;
using Floats = hn::RebindToFloat<Sums>;

/// Loads every kStep-th sum.
template <int kStep>
HWY_INLINE hn::Vec<Sums> load_sums(const std::uint32_t* from) {
  const Sums d;
  if constexpr (kStep == 1) {
    return hn::LoadU(d, from);
  } else if constexpr (kStep == 2) {
    hn::Vec<Sums> even, odd;
    hn::LoadInterleaved2(d, from, even, odd);
    return even;
  } else {
    return hn::GatherIndex(d, from, hn::Mul(hn::Iota(Signed(), 0), hn::Set(Signed(), kStep)));
  }
}

template <int kStep>
HWY_INLINE void hessian_of(const HessianRows& r, int count, float* out) {
  const Sums d;
  const Signed integers;
  const Floats floats;
  const auto area = hn::Set(floats, r.area), cross = hn::Set(floats, 0.81f);
  const auto three = hn::Set(integers, 3);
  for (int i = 0; i < count; i += static_cast<int>(hn::Lanes(d))) {
    const int x = i * kStep;
    const auto box = [&](const std::uint32_t* top, const std::uint32_t* bottom, int from, int to) HWY_ATTR {
      const auto lower = hn::Sub(load_sums<kStep>(bottom + x + to), load_sums<kStep>(bottom + x + from));
      const auto upper = hn::Sub(load_sums<kStep>(top + x + to), load_sums<kStep>(top + x + from));
      return hn::BitCast(integers, hn::Sub(lower, upper));
    };
    const auto scaled = [&](hn::Vec<Signed> v) HWY_ATTR { return hn::Mul(hn::ConvertTo(floats, v), area); };
    const auto xx = scaled(hn::Sub(box(r.xx_top, r.xx_bottom, -r.half, r.half + 1),
                                   hn::Mul(three, box(r.xx_top, r.xx_bottom, -r.inner, r.inner + 1))));
    const auto yy = scaled(hn::Sub(box(r.yy_top, r.yy_bottom, 1 - r.lobe, r.lobe),
                                   hn::Mul(three, box(r.yy_upper, r.yy_lower, 1 - r.lobe, r.lobe))));
    const auto xy =
        scaled(hn::Sub(hn::Add(box(r.xy_top, r.above, 1, r.lobe + 1), box(r.below, r.xy_bottom, -r.lobe, 0)),
                       hn::Add(box(r.xy_top, r.above, -r.lobe, 0), box(r.below, r.xy_bottom, 1, r.lobe + 1))));
    hn::StoreU(hn::Sub(hn::Mul(xx, yy), hn::Mul(cross, hn::Mul(xy, xy))), floats, out + i);
  }
}

void hessian(const HessianRows& rows, int count, int step, float* out) {
  switch (step) {
    case 1:
      return hessian_of<1>(rows, count, out);
    case 2:
      return hessian_of<2>(rows, count, out);
    case 4:
      return hessian_of<4>(rows, count, out);
    case 8:
      return hessian_of<8>(rows, count, out);
    default:
      return hessian_of<16>(rows, count, out);
  }
}

void maxima(const float* above, const float* row, const float* below, int first, int last, float threshold,
            std::vector<int>& columns) {
  const Floats d;
  const auto limit = hn::Set(d, threshold);
  for (int x = first; x <= last; x += static_cast<int>(hn::Lanes(d))) {
    const auto centre = hn::LoadU(d, row + x);
    const auto beside = hn::Max(hn::LoadU(d, row + x - 1), hn::LoadU(d, row + x + 1));
    const auto across = hn::Max(hn::LoadU(d, above + x), hn::LoadU(d, below + x));
    const auto is_largest = hn::Gt(centre, hn::Max(limit, hn::Max(beside, across)));
    if (hn::AllFalse(d, is_largest)) continue;
    HWY_ALIGN std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, is_largest, bits);
    const unsigned mask = bits[0] | static_cast<unsigned>(bits[1]) << 8U;
    for (int i = 0; i < static_cast<int>(hn::Lanes(d)) && x + i <= last; ++i)
      if ((mask >> static_cast<unsigned>(i) & 1U) != 0) columns.push_back(x + i);
  }
}

struct Haar {
  hn::Vec<Floats> dx, dy;
};

/// Haar responses at pixel corners; boxes are clipped to the image.
HWY_INLINE Haar haar(const IntegralImage& integral, hn::Vec<Signed> x, hn::Vec<Signed> y, int half) {
  const Sums d;
  const Signed integers;
  const Floats floats;
  const auto stride = hn::Set(integers, static_cast<std::int32_t>(integral.row(1) - integral.row(0)));
  const auto clipped = [&](hn::Vec<Signed> v, int offset, int last) HWY_ATTR {
    return hn::Max(hn::Zero(integers), hn::Min(hn::Add(v, hn::Set(integers, offset)), hn::Set(integers, last)));
  };
  const auto left = clipped(x, -half, integral.width()), column = clipped(x, 0, integral.width()),
             right = clipped(x, half, integral.width());
  const auto top = hn::Mul(clipped(y, -half, integral.height()), stride),
             row = hn::Mul(clipped(y, 0, integral.height()), stride),
             bottom = hn::Mul(clipped(y, half, integral.height()), stride);
  const auto at = [&](hn::Vec<Signed> r, hn::Vec<Signed> c)
                      HWY_ATTR { return hn::GatherIndex(d, integral.row(0), hn::Add(r, c)); };
  const auto top_left = at(top, left), top_right = at(top, right), bottom_left = at(bottom, left),
             bottom_right = at(bottom, right);
  const auto twice = [](hn::Vec<Sums> v) HWY_ATTR { return hn::Add(v, v); };
  const auto dx = hn::Sub(hn::Add(hn::Add(bottom_right, bottom_left), twice(at(top, column))),
                          hn::Add(hn::Add(top_right, top_left), twice(at(bottom, column))));
  const auto dy = hn::Sub(hn::Add(hn::Add(bottom_right, top_right), twice(at(row, left))),
                          hn::Add(hn::Add(bottom_left, top_left), twice(at(row, right))));
  return {hn::ConvertTo(floats, hn::BitCast(integers, dx)), hn::ConvertTo(floats, hn::BitCast(integers, dy))};
}

void sum_haar(const IntegralImage& integral, const DescriptorPlace& p, float* out) {
  const Floats d;
  const HaarTable& table = haar_table();
  const auto scaled_cosine = hn::Set(d, p.scale * p.cosine), scaled_sine = hn::Set(d, p.scale * p.sine);
  const auto cosine = hn::Set(d, p.cosine), sine = hn::Set(d, p.sine);
  for (int region = 0; region < kHaarRegions; region += static_cast<int>(hn::Lanes(d))) {
    auto sum_x = hn::Zero(d), sum_abs_x = hn::Zero(d), sum_y = hn::Zero(d), sum_abs_y = hn::Zero(d);
    for (int sample = 0; sample < kHaarSamples; ++sample) {
      const auto a = hn::Load(d, table.x[sample] + region), b = hn::Load(d, table.y[sample] + region);
      const auto x = hn::Add(hn::Set(d, p.x + 0.5f), hn::Sub(hn::Mul(scaled_cosine, a), hn::Mul(scaled_sine, b)));
      const auto y = hn::Add(hn::Set(d, p.y + 0.5f), hn::Add(hn::Mul(scaled_sine, a), hn::Mul(scaled_cosine, b)));
      const Haar response = haar(integral, hn::NearestInt(x), hn::NearestInt(y), p.half);
      const auto weight = hn::Load(d, table.weight[sample] + region);
      const auto dx = hn::Mul(weight, hn::Add(hn::Mul(cosine, response.dx), hn::Mul(sine, response.dy)));
      const auto dy = hn::Mul(weight, hn::Sub(hn::Mul(cosine, response.dy), hn::Mul(sine, response.dx)));
      sum_x = hn::Add(sum_x, dx);
      sum_abs_x = hn::Add(sum_abs_x, hn::Abs(dx));
      sum_y = hn::Add(sum_y, dy);
      sum_abs_y = hn::Add(sum_abs_y, hn::Abs(dy));
    }
    hn::StoreInterleaved4(sum_x, sum_abs_x, sum_y, sum_abs_y, d, out + static_cast<std::ptrdiff_t>(4) * region);
  }
}

void orient(const IntegralImage& integral, const DescriptorPlace& p, OrientationResponses& out) {
  const Floats d;
  const OrientationTable& table = orientation_table();
  const auto scale = hn::Set(d, p.scale);
  for (int i = 0; i < kOrientationRoom; i += static_cast<int>(hn::Lanes(d))) {
    const auto x = hn::Add(hn::Set(d, p.x), hn::Mul(scale, hn::Load(d, table.x + i)));
    const auto y = hn::Add(hn::Set(d, p.y), hn::Mul(scale, hn::Load(d, table.y + i)));
    const Haar response = haar(integral, hn::NearestInt(x), hn::NearestInt(y), p.half);
    const auto weight = hn::Load(d, table.weight + i);
    hn::Store(hn::Mul(weight, response.dx), d, out.dx + i);
    hn::Store(hn::Mul(weight, response.dy), d, out.dy + i);
  }
}

void smooth(const float* support, const GaussianKernel& kernel, float* smoothed) {
  const Floats d;
  const int lanes = static_cast<int>(hn::Lanes(d)), radius = kernel.radius, first = kMaxGaussianRadius - radius;
  HWY_ALIGN float column[kSupportStride];
  for (int y = 0; y < kSmoothedSide; ++y) {
    const float* centre = support + static_cast<std::ptrdiff_t>(y + kMaxGaussianRadius) * kSupportStride;
    for (int x = first; x < first + kSmoothedSide + 2 * radius; x += lanes) {
      auto sum = hn::Mul(hn::Set(d, kernel.weights[0]), hn::LoadU(d, centre + x));
      for (int j = 1; j <= radius; ++j) {
        const std::ptrdiff_t offset = static_cast<std::ptrdiff_t>(j) * kSupportStride;
        const auto both = hn::Add(hn::LoadU(d, centre + x - offset), hn::LoadU(d, centre + x + offset));
        sum = hn::Add(sum, hn::Mul(hn::Set(d, kernel.weights[j]), both));
      }
      hn::StoreU(sum, d, column + x);
    }
    for (int x = 0; x < kSmoothedSide; x += lanes) {
      const float* middle = column + x + kMaxGaussianRadius;
      auto sum = hn::Mul(hn::Set(d, kernel.weights[0]), hn::LoadU(d, middle));
      for (int j = 1; j <= radius; ++j) {
        const auto both = hn::Add(hn::LoadU(d, middle - j), hn::LoadU(d, middle + j));
        sum = hn::Add(sum, hn::Mul(hn::Set(d, kernel.weights[j]), both));
      }
      hn::StoreU(sum, d, smoothed + static_cast<std::ptrdiff_t>(y) * kSmoothedStride + x);
    }
  }
}

}  // namespace spartan::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::internal {

const HaarTable& haar_table() {
  static const HaarTable table = [] {
    // Standard deviation of the weights, in units of the scale (Bay et al., §4.2).
    constexpr float kHaarSigma = 3.3f;
    HaarTable t{};
    for (int sample = 0; sample < kHaarSamples; ++sample) {
      for (int region = 0; region < kHaarRegions; ++region) {
        const int column = 5 * (region % 4) + sample % 5, row = 5 * (region / 4) + sample / 5;
        const float x = static_cast<float>(column) - 9.5f, y = static_cast<float>(row) - 9.5f;
        t.x[sample][region] = x;
        t.y[sample][region] = y;
        t.weight[sample][region] = std::exp(-(x * x + y * y) / (2 * kHaarSigma * kHaarSigma));
      }
    }
    return t;
  }();
  return table;
}

const OrientationTable& orientation_table() {
  static const OrientationTable table = [] {
    constexpr float kOrientationSigma = 2.5f;
    OrientationTable t{};
    int count = 0;
    for (int j = -5; j <= 5; ++j) {
      for (int i = -5; i <= 5; ++i) {
        if (i * i + j * j >= 36) continue;
        t.x[count] = static_cast<float>(i);
        t.y[count] = static_cast<float>(j);
        t.weight[count++] = std::exp(-static_cast<float>(i * i + j * j) / (2 * kOrientationSigma * kOrientationSigma));
      }
    }
    return t;
  }();
  return table;
}

HWY_EXPORT(orient);
HWY_EXPORT(smooth);
HWY_EXPORT(hessian);
HWY_EXPORT(maxima);
HWY_EXPORT(sum_haar);

void hessian_row(const IntegralImage& integral, int y, int x0, int count, int filter_px, int step, float* out) {
  const int lobe = filter_px / 3, half = filter_px / 2, inner = lobe / 2;
  const auto row = [&](int offset) { return integral.row(y + offset) + x0; };
  const HessianRows rows{row(1 - lobe),  row(lobe),
                         row(-half),     row(-inner),
                         row(inner + 1), row(half + 1),
                         row(-lobe),     row(0),
                         row(1),         row(lobe + 1),
                         lobe,           half,
                         inner,          1.0f / static_cast<float>(filter_px * filter_px)};
  HWY_DYNAMIC_DISPATCH(hessian)(rows, count, step, out);
}

void maxima_of_row(const float* above, const float* row, const float* below, int first, int last, float threshold,
                   std::vector<int>& columns) {
  HWY_DYNAMIC_DISPATCH(maxima)(above, row, below, first, last, threshold, columns);
}

std::array<float, 64> haar_sums(const IntegralImage& integral, const DescriptorPlace& place) {
  std::array<float, 64> sums;
  HWY_DYNAMIC_DISPATCH(sum_haar)(integral, place, sums.data());
  return sums;
}

OrientationResponses orientation_responses(const IntegralImage& integral, const DescriptorPlace& place) {
  OrientationResponses responses;
  HWY_DYNAMIC_DISPATCH(orient)(integral, place, responses);
  return responses;
}

void smooth_middle(const float* support, const GaussianKernel& kernel, float* smoothed) {
  HWY_DYNAMIC_DISPATCH(smooth)(support, kernel, smoothed);
}

}  // namespace spartan::internal
#endif  // HWY_ONCE
