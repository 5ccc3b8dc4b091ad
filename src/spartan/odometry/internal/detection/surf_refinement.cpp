#include "spartan/odometry/internal/detection/surf_refinement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "spartan/odometry/internal/detection/surf_kernels.h"

namespace spartan::internal {
namespace {

/// Scales of the cube, a quarter of an octave apart, and samples in x and y; its inner part is searched.
constexpr int kCubeScales = 5, kCubeSide = 7;
constexpr int kScalesPerOctave = 4;
static_assert(kCubeSide + 2 == kSmoothedSide);  // with the neighbours that the second derivatives need
/// Scales in samples are 2^(i/4). A feature is refined in the level where its scale is from 2 to 4 samples, or less in
/// the first level; below √2 second differences of samples are not isotropic.
constexpr int kMinScale = 2, kMaxScale = 8, kScales = kMaxScale + kCubeScales / 2 + 1;
/// Standard deviation of the blur that every level has: pixels of the camera, and of the filter below.
constexpr float kLevelSigma_px = 0.55f;
constexpr int kMaxMoves = 3;

using Support = std::array<float, static_cast<std::size_t>(kSupportSide) * kSupportStride>;
using Smoothed = std::array<float, static_cast<std::size_t>(kSmoothedSide) * kSmoothedStride>;
using Cube3 = float[kCubeScales][kCubeSide][kCubeSide];

float scale_at(float index) {
  return std::exp2(index / kScalesPerOctave);
}

/// Smooths a level to each scale, cut off at three standard deviations.
const std::array<GaussianKernel, kScales>& gaussian_kernels() {
  static const std::array<GaussianKernel, kScales> kernels = [] {
    std::array<GaussianKernel, kScales> result{};
    for (int index = 0; index < kScales; ++index) {
      GaussianKernel& kernel = result[static_cast<std::size_t>(index)];
      const float scale = scale_at(static_cast<float>(index));
      const float variance = scale * scale - kLevelSigma_px * kLevelSigma_px;
      kernel.radius = std::min(kMaxGaussianRadius, static_cast<int>(std::ceil(3 * std::sqrt(variance))));
      float sum = 0;
      for (int i = 0; i <= kernel.radius; ++i) {
        kernel.weights[i] = std::exp(-static_cast<float>(i * i) / (2 * variance));
        sum += i == 0 ? kernel.weights[i] : 2 * kernel.weights[i];
      }
      for (float& weight : kernel.weights) weight /= sum;
    }
    return result;
  }();
  return kernels;
}

/// σ⁴ (Lxx Lyy − Lxy²).
void fill_determinants(const Support& support, int scale_index, float (&cube)[kCubeSide][kCubeSide]) {
  alignas(64) Smoothed s;
  smooth_middle(support.data(), gaussian_kernels()[static_cast<std::size_t>(scale_index)], s.data());
  const float normalization = scale_at(static_cast<float>(4 * scale_index));
  for (int y = 0; y < kCubeSide; ++y) {
    for (int x = 0; x < kCubeSide; ++x) {
      constexpr int kDown = kSmoothedStride;
      const float* c = s.data() + static_cast<std::ptrdiff_t>(y + 1) * kDown + x + 1;
      const float xx = c[1] + c[-1] - 2 * c[0], yy = c[kDown] + c[-kDown] - 2 * c[0];
      const float xy = 0.25f * (c[kDown + 1] - c[kDown - 1] - c[1 - kDown] + c[-1 - kDown]);
      cube[y][x] = normalization * (xx * yy - xy * xy);
    }
  }
}

struct CubePlace {
  int scale, y, x;
  bool is_inside() const {
    return std::min({scale, y, x}) > 0 && scale + 1 < kCubeScales && std::max(y, x) + 1 < kCubeSide;
  }
};

/// From the middle upwards, to a maximum or to the border of the cube. Scales are filled where they are needed; the
/// middle one has the given index.
CubePlace climb(const Support& support, int scale_index, Cube3& v) {
  CubePlace at{kCubeScales / 2, kCubeSide / 2, kCubeSide / 2};
  bool filled[kCubeScales] = {};
  while (at.is_inside()) {
    for (int s = at.scale - 1; s <= at.scale + 1; ++s) {
      if (!filled[s]) fill_determinants(support, scale_index + s - kCubeScales / 2, v[s]);
      filled[s] = true;
    }
    CubePlace best = at;
    for (int s = at.scale - 1; s <= at.scale + 1; ++s) {
      for (int y = at.y - 1; y <= at.y + 1; ++y) {
        for (int x = at.x - 1; x <= at.x + 1; ++x)
          if (v[s][y][x] > v[best.scale][best.y][best.x]) best = {s, y, x};
      }
    }
    if (best.scale == at.scale && best.y == at.y && best.x == at.x) break;
    at = best;
  }
  return at;
}

/// Maximum of the quadratic through a maximum of the cube and its neighbours, (x, y, scale) in samples from it; 0 where
/// it is not near.
Eigen::Vector3f peak_at(const Cube3& v, const CubePlace& at) {
  const auto value = [&](int s, int y, int x) { return v[at.scale + s][at.y + y][at.x + x]; };
  const float twice = 2 * value(0, 0, 0);
  const Eigen::Vector3f gradient(0.5f * (value(0, 0, 1) - value(0, 0, -1)), 0.5f * (value(0, 1, 0) - value(0, -1, 0)),
                                 0.5f * (value(1, 0, 0) - value(-1, 0, 0)));
  const float xy = 0.25f * (value(0, 1, 1) - value(0, 1, -1) - value(0, -1, 1) + value(0, -1, -1));
  const float xs = 0.25f * (value(1, 0, 1) - value(1, 0, -1) - value(-1, 0, 1) + value(-1, 0, -1));
  const float ys = 0.25f * (value(1, 1, 0) - value(1, -1, 0) - value(-1, 1, 0) + value(-1, -1, 0));
  Eigen::Matrix3f hessian;
  hessian << value(0, 0, 1) + value(0, 0, -1) - twice, xy, xs,  //
      xy, value(0, 1, 0) + value(0, -1, 0) - twice, ys,         //
      xs, ys, value(1, 0, 0) + value(-1, 0, 0) - twice;
  const Eigen::Vector3f peak = -hessian.inverse() * gradient;
  return peak.cwiseAbs().maxCoeff() <= 1 ? peak : Eigen::Vector3f::Zero();
}

/// Half of the size, smoothed by [1 4 6 4 1]/16; pixel (x, y) lies at (2x, 2y).
template <class T>
Image<float> half_of(ImageView<const T> image) {
  Image<float> rows((image.width() + 1) / 2, image.height()), half((image.width() + 1) / 2, (image.height() + 1) / 2);
  const auto clamped = [](int i, int count) { return std::clamp(i, 0, count - 1); };
  const auto binomial = [](auto a, auto b, auto c, auto d, auto e) {
    return (static_cast<float>(a + e) + 4 * static_cast<float>(b + d) + 6 * static_cast<float>(c)) / 16;
  };
  for (int y = 0; y < image.height(); ++y) {
    const T* from = image.row(y);
    const auto at = [&](int x) { return from[clamped(x, image.width())]; };
    float* to = rows.row(y);
    for (int x = 0; x < rows.width(); ++x) {
      const int i = 2 * x;
      to[x] = i >= 2 && i + 2 < image.width() ? binomial(from[i - 2], from[i - 1], from[i], from[i + 1], from[i + 2])
                                              : binomial(at(i - 2), at(i - 1), at(i), at(i + 1), at(i + 2));
    }
  }
  for (int y = 0; y < half.height(); ++y) {
    const auto row = [&](int offset) { return rows.row(clamped(2 * y + offset, rows.height())); };
    const float *a = row(-2), *b = row(-1), *c = row(0), *d = row(1), *e = row(2);
    float* to = half.row(y);
    for (int x = 0; x < half.width(); ++x) to[x] = binomial(a[x], b[x], c[x], d[x], e[x]);
  }
  return half;
}

template <class T>
void copy_support(ImageView<const T> image, int x0, int y0, Support& support) {
  for (int y = 0; y < kSupportSide; ++y) {
    const T* row = image.row(y0 + y) + x0;
    float* to = support.data() + static_cast<std::ptrdiff_t>(y) * kSupportStride;
    for (int x = 0; x < kSupportSide; ++x) to[x] = static_cast<float>(row[x]);
  }
}

}  // namespace

void SurfRefinement::compute(ImageView<const std::uint8_t> image) {
  image_ = image;
  halves_.clear();
  for (int level = 1; level < kLevels; ++level) {
    halves_.push_back(level == 1 ? half_of<std::uint8_t>(image) : half_of<float>(std::as_const(halves_.back()).view()));
  }
}

std::optional<Feature> SurfRefinement::refined(const Feature& feature) const {
  const int level = std::clamp(static_cast<int>(std::floor(std::log2(feature.scale))) - 1, 0, kLevels - 1);
  const auto step = static_cast<float>(1 << level);
  const ImageSize size = level == 0 ? image_.size() : halves_[static_cast<std::size_t>(level - 1)].size();
  int x = static_cast<int>(std::lround(feature.x / step)), y = static_cast<int>(std::lround(feature.y / step));
  int scale = static_cast<int>(std::lround(kScalesPerOctave * std::log2(feature.scale / step)));
  for (int move = 0; move < kMaxMoves; ++move) {
    scale = std::clamp(scale, kMinScale, kMaxScale);
    const int x0 = x - kSupportSide / 2, y0 = y - kSupportSide / 2;
    if (x0 < 0 || y0 < 0 || x0 + kSupportSide > size.width || y0 + kSupportSide > size.height) return std::nullopt;
    alignas(64) Support support;
    if (level == 0) {
      copy_support(image_, x0, y0, support);
    } else {
      copy_support(halves_[static_cast<std::size_t>(level - 1)].view(), x0, y0, support);
    }
    Cube3 cube;
    const CubePlace at = climb(support, scale, cube);
    const int found_x = x + at.x - kCubeSide / 2, found_y = y + at.y - kCubeSide / 2;
    const int found_scale = scale + at.scale - kCubeScales / 2;
    if (at.is_inside()) {
      if (!(cube[at.scale][at.y][at.x] > 0)) return std::nullopt;  // a saddle
      const Eigen::Vector3f peak = peak_at(cube, at);
      Feature result = feature;
      result.x = (static_cast<float>(found_x) + peak.x()) * step;
      result.y = (static_cast<float>(found_y) + peak.y()) * step;
      result.scale = scale_at(static_cast<float>(found_scale) + peak.z()) * step;
      return result;
    }
    x = found_x;
    y = found_y;
    scale = found_scale;
  }
  return std::nullopt;
}

}  // namespace spartan::internal
