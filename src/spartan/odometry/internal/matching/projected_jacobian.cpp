#include "spartan/odometry/internal/matching/projected_jacobian.h"

// Compiled once per instruction set: Highway includes this file again for each.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "spartan/odometry/internal/matching/projected_jacobian.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#ifndef SPARTAN_PROJECTED_JACOBIAN_TYPES
#define SPARTAN_PROJECTED_JACOBIAN_TYPES
namespace spartan::internal {

/// Most functions of a window: the template, its derivative by the scale or none, the columns of the Jacobian.
constexpr int kMaxFunctions = 5;
/// Functions that a column is combined with: 1, i, j, the template and its derivative by the scale.
constexpr int kMaxNuisance = 5;

/// The functions f of a window: first the template and, if it is a nuisance, the derivative by the scale, then the
/// columns of the Jacobian.
struct FunctionCounts {
  int nuisance, all;
};
constexpr FunctionCounts functions_of(AlignmentUnknowns unknowns) {
  const int nuisance = unknowns == AlignmentUnknowns::position ? 2 : 1;
  return {nuisance, nuisance + count_of(unknowns)};
}

struct WindowMoments {
  float planes[kMaxFunctions][3];                // Σ w f, Σ w i f, Σ w j f
  float products[kMaxFunctions][kMaxFunctions];  // Σ w f fᵀ, lower triangle
};

/// Of each column the shares of 1, i, j, the template and its derivative by the scale.
struct NuisanceShares {
  float of[kMaxFactors - 1][kMaxNuisance];
};

}  // namespace spartan::internal
#endif

HWY_BEFORE_NAMESPACE();
namespace spartan::internal::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kWindowStride>;
using Values = hn::Vec<Floats>;

/// Some neighbouring pixels of a window.
struct Pixels {
  Values weight, i, j, value, along_x, along_y;
  std::size_t at;

  HWY_INLINE Pixels(const WindowGradients& reference, const float* weights, int row, int first)
      : at(static_cast<std::size_t>(row * kWindowStride + first)) {
    const Floats d;
    weight = hn::Load(d, weights + at);
    i = hn::Iota(d, static_cast<float>(first - kWindowRadius));
    j = hn::Set(d, static_cast<float>(row - kWindowRadius));
    value = hn::Load(d, reference.value.values.data() + at);
    along_x = hn::Load(d, reference.along_x.values.data() + at);
    along_y = hn::Load(d, reference.along_y.values.data() + at);
  }
};

/// The functions of AlignmentUnknowns at some pixels.
template <AlignmentUnknowns kUnknowns>
HWY_INLINE void functions_at(const Pixels& p, Values* f) {
  f[0] = p.value;
  if constexpr (kUnknowns == AlignmentUnknowns::position) {
    f[1] = hn::MulAdd(p.i, p.along_x, hn::Mul(p.j, p.along_y));
    f[2] = p.along_x;
    f[3] = p.along_y;
  } else if constexpr (kUnknowns == AlignmentUnknowns::disparity_and_slant) {
    f[1] = hn::Neg(p.along_x);
    f[2] = hn::Mul(p.i, f[1]);
    f[3] = hn::Mul(p.j, f[1]);
  } else {
    f[1] = p.along_x;
    f[2] = p.along_y;
    f[3] = hn::Neg(hn::Mul(p.i, p.along_x));
    f[4] = hn::Neg(hn::Mul(p.j, p.along_x));
  }
}

template <AlignmentUnknowns kUnknowns>
HWY_INLINE void moments_with(const WindowGradients& reference, WindowMoments& moments) {
  constexpr int kCount = functions_of(kUnknowns).all;
  const Floats d;
  const float* const weights = window_weights().values.data();
  Values planes[kCount][3], products[kCount][kCount];
  for (int a = 0; a < kCount; ++a) {
    for (Values& sum : planes[a]) sum = hn::Zero(d);
    for (int b = 0; b < kCount; ++b) products[a][b] = hn::Zero(d);
  }
  for (int row = 0; row < kWindowSide; ++row) {
    for (int first = 0; first < kWindowStride; first += static_cast<int>(hn::Lanes(d))) {
      const Pixels p(reference, weights, row, first);
      Values f[kCount];
      functions_at<kUnknowns>(p, f);
      for (int a = 0; a < kCount; ++a) {
        const Values weighted = hn::Mul(p.weight, f[a]);
        planes[a][0] = hn::Add(planes[a][0], weighted);
        planes[a][1] = hn::MulAdd(p.i, weighted, planes[a][1]);
        planes[a][2] = hn::MulAdd(p.j, weighted, planes[a][2]);
        for (int b = 0; b < kCount; ++b)
          if (b <= a) products[a][b] = hn::MulAdd(weighted, f[b], products[a][b]);
      }
    }
  }
  for (int a = 0; a < kCount; ++a) {
    for (int k = 0; k < 3; ++k) moments.planes[a][k] = hn::GetLane(hn::SumOfLanes(d, planes[a][k]));
    for (int b = 0; b < kCount; ++b)
      if (b <= a) moments.products[a][b] = hn::GetLane(hn::SumOfLanes(d, products[a][b]));
  }
}

/// w T and w (J − shares of the nuisance).
template <AlignmentUnknowns kUnknowns>
HWY_INLINE void factors_with(const WindowGradients& reference, const NuisanceShares& shares, Window* factors) {
  constexpr FunctionCounts kCounts = functions_of(kUnknowns);
  const Floats d;
  const float* const weights = window_weights().values.data();
  for (int row = 0; row < kWindowSide; ++row) {
    for (int first = 0; first < kWindowStride; first += static_cast<int>(hn::Lanes(d))) {
      const Pixels p(reference, weights, row, first);
      Values f[kCounts.all];
      functions_at<kUnknowns>(p, f);
      hn::Store(hn::Mul(p.weight, f[0]), d, factors[0].values.data() + p.at);
      for (int a = 0; a < kCounts.all - kCounts.nuisance; ++a) {
        const float* const share = shares.of[a];
        Values left = hn::Sub(f[kCounts.nuisance + a], hn::Set(d, share[0]));
        left = hn::NegMulAdd(hn::Set(d, share[1]), p.i, left);
        left = hn::NegMulAdd(hn::Set(d, share[2]), p.j, left);
        for (int k = 0; k < kCounts.nuisance; ++k) left = hn::NegMulAdd(hn::Set(d, share[3 + k]), f[k], left);
        hn::Store(hn::Mul(p.weight, left), d, factors[a + 1].values.data() + p.at);
      }
    }
  }
}

void moments_of(const WindowGradients& reference, AlignmentUnknowns unknowns, WindowMoments& moments) {
  using enum AlignmentUnknowns;
  switch (unknowns) {
    case position:
      return moments_with<position>(reference, moments);
    case disparity_and_slant:
      return moments_with<disparity_and_slant>(reference, moments);
    case position_and_slant:
      return moments_with<position_and_slant>(reference, moments);
  }
}

void factors_of(const WindowGradients& reference, AlignmentUnknowns unknowns, const NuisanceShares& shares,
                Window* factors) {
  using enum AlignmentUnknowns;
  switch (unknowns) {
    case position:
      return factors_with<position>(reference, shares, factors);
    case disparity_and_slant:
      return factors_with<disparity_and_slant>(reference, shares, factors);
    case position_and_slant:
      return factors_with<position_and_slant>(reference, shares, factors);
  }
}

}  // namespace spartan::internal::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace spartan::internal {
namespace {

/// A function whose square is smaller than this fraction after the others are removed depends on them.
constexpr double kMinIndependent = 1e-4;

/// Σ w i² = Σ w j² over the window.
double square_of_plane() {
  static const double square = [] {
    double sum = 0;
    for (int row = 0; row < kWindowSide; ++row) {
      for (int column = 0; column < kWindowSide; ++column) {
        const double offset = column - kWindowRadius;
        sum += offset * offset *
               static_cast<double>(window_weights().values[static_cast<std::size_t>(row * kWindowStride + column)]);
      }
    }
    return sum;
  }();
  return square;
}

/// Gram-Schmidt on the products of functions in place of the functions. Functions that are missing are 0.
class Elimination {
 public:
  explicit Elimination(const WindowMoments& moments) {
    const double square = square_of_plane();
    for (int a = 0; a < kMaxFunctions; ++a) {
      const double mean = moments.planes[a][0], x = moments.planes[a][1], y = moments.planes[a][2];
      shares_.row(a) << mean, x / square, y / square, 0, 0;
      variances_[a] = moments.products[a][a] - mean * mean;
      for (int b = 0; b <= a; ++b) {
        products_(a, b) = products_(b, a) = moments.products[a][b] - mean * moments.planes[b][0] -
                                            (x * moments.planes[b][1] + y * moments.planes[b][2]) / square;
      }
    }
  }

  /// Makes the functions behind `k` orthogonal to it, unless it is a combination of those before.
  void remove(int k) {
    const double square = products_(k, k);
    if (!(square > kMinIndependent * variances_[k])) return;
    for (int a = k + 1; a < kMaxFunctions; ++a) {
      const double share = products_(a, k) / square;
      products_.row(a) -= share * products_.row(k);
      shares_.row(a) -= share * shares_.row(k);
      shares_(a, 3 + k) += share;
    }
  }

  /// Σ w f_a f_b of what is left of the functions.
  double product(int a, int b) const { return products_(a, b); }
  /// What is subtracted from the function `a`: the share of nuisance `n`.
  double share(int a, int n) const { return shares_(a, n); }

 private:
  Eigen::Matrix<double, kMaxFunctions, kMaxFunctions, Eigen::RowMajor> products_;
  Eigen::Matrix<double, kMaxFunctions, kMaxNuisance, Eigen::RowMajor> shares_;
  Eigen::Matrix<double, kMaxFunctions, 1> variances_;
};

}  // namespace

HWY_EXPORT(moments_of);
HWY_EXPORT(factors_of);

ProjectedJacobian::ProjectedJacobian(const WindowGradients& reference, AlignmentUnknowns unknowns) {
  const FunctionCounts counts = functions_of(unknowns);
  WindowMoments moments{};
  HWY_DYNAMIC_DISPATCH(moments_of)(reference, unknowns, moments);
  Elimination elimination(moments);
  for (int k = 0; k < counts.nuisance; ++k) elimination.remove(k);
  NuisanceShares shares;
  for (int a = 0; a < count_of(unknowns); ++a) {
    const int column = counts.nuisance + a;
    for (int n = 0; n < kMaxNuisance; ++n) shares.of[a][n] = static_cast<float>(elimination.share(column, n));
    for (int b = 0; b <= a; ++b) {
      information(a, b) = information(b, a) = elimination.product(column, counts.nuisance + b);
    }
  }
  HWY_DYNAMIC_DISPATCH(factors_of)(reference, unknowns, shares, factors.data());
}

}  // namespace spartan::internal
#endif  // HWY_ONCE
