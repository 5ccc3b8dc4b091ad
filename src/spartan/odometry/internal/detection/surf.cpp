#include "spartan/odometry/internal/detection/surf.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "spartan/odometry/internal/detection/feature_spread.h"
#include "spartan/odometry/internal/detection/surf_kernels.h"

namespace spartan::internal {
namespace {

constexpr int kLayersPerOctave = 4;
/// Parts of the image that are searched in parallel.
constexpr int kSurfParts = 8;
/// Features are refined beyond those wanted.
constexpr int kMoreToRefine_percent = 40, kMoreToRefine = 10;
/// Values behind a row of responses that vectors may write or read.
constexpr int kRowRoom = 2 * kSurfPadding;

/// Filter sides 9, 15, 21, 27 / 15, 27, 39, 51 / … (§3.3).
int filter_size(int octave, int layer) {
  return 3 * ((2 << octave) * (layer + 1) + 1);
}

/// Blob scale of a filter: the 9-px filter approximates Gaussian derivatives of σ = 1.2 px (§3.2).
float scale_of_filter(float filter_px) {
  return 1.2f * filter_px / 9.0f;
}

/// The 3×3×3 neighbourhood of a response: v[scale][y][x].
struct Cube {
  float v[3][3][3];

  /// True where the centre is larger than all 26 neighbours (non-maximum suppression).
  bool is_maximum() const {
    const float centre = v[1][1][1];
    for (int s = 0; s < 3; ++s) {
      for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 3; ++x)
          if ((s != 1 || y != 1 || x != 1) && !(centre > v[s][y][x])) return false;
      }
    }
    return true;
  }

  /// Maximum of the quadratic through the cube, (x, y, scale) in grid units from the centre (Brown & Lowe, "Invariant
  /// features from interest point groups", BMVC 2002).
  Eigen::Vector3f peak() const {
    const auto& c = v[1];
    const Eigen::Vector3f gradient(0.5f * (c[1][2] - c[1][0]), 0.5f * (c[2][1] - c[0][1]),
                                   0.5f * (v[2][1][1] - v[0][1][1]));
    const float twice = 2 * c[1][1];
    const float xy = 0.25f * (c[2][2] - c[2][0] - c[0][2] + c[0][0]);
    const float xs = 0.25f * (v[2][1][2] - v[2][1][0] - v[0][1][2] + v[0][1][0]);
    const float ys = 0.25f * (v[2][2][1] - v[2][0][1] - v[0][2][1] + v[0][0][1]);
    Eigen::Matrix3f hessian;
    hessian << c[1][2] + c[1][0] - twice, xy, xs,  //
        xy, c[2][1] + c[0][1] - twice, ys,         //
        xs, ys, v[2][1][1] + v[0][1][1] - twice;
    return -hessian.inverse() * gradient;
  }
};

/// Angle of a vector in turns, 0 … 1, to 0.001: a polynomial for an eighth of the circle (Abramowitz and
/// Stegun, 4.4.47).
float turns_of(float x, float y) {
  const float a = std::abs(x), b = std::abs(y), ratio = std::min(a, b) / std::max({a, b, 1e-20f});
  const float square = ratio * ratio;
  float turns = ratio * (0.1588f + square * (-0.0512f + square * 0.0174f));
  if (b > a) turns = 0.25f - turns;
  if (x < 0) turns = 0.5f - turns;
  return y < 0 ? 1 - turns : turns;
}

}  // namespace

BoxHessian box_hessian(const IntegralImage& integral, int x, int y, int filter_px) {
  const int lobe = filter_px / 3, half = filter_px / 2, inner = lobe / 2;
  const float area = 1.0f / static_cast<float>(filter_px * filter_px);
  const auto box = [&](int x0, int y0, int x1, int y1) {
    return static_cast<float>(static_cast<std::int32_t>(integral.box(x + x0, y + y0, x + x1, y + y1)));
  };
  return {area * (box(-half, 1 - lobe, half + 1, lobe) - 3 * box(-inner, 1 - lobe, inner + 1, lobe)),
          area * (box(1 - lobe, -half, lobe, half + 1) - 3 * box(1 - lobe, -inner, lobe, inner + 1)),
          area * (box(1, -lobe, lobe + 1, 0) + box(-lobe, 1, 0, lobe + 1) - box(-lobe, -lobe, 0, 0) -
                  box(1, 1, lobe + 1, lobe + 1))};
}

float surf_orientation(const IntegralImage& integral, const Feature& feature) {
  // Responses are gathered in bins of 5°, of which the window of π/3 has twelve.
  constexpr int kBins = 72, kWindowBins = kBins / 6;
  const int half = std::max(1, static_cast<int>(std::lround(2 * feature.scale)));
  const OrientationResponses responses =
      orientation_responses(integral, {feature.x, feature.y, feature.scale, 1, 0, half});
  float dx[kBins] = {}, dy[kBins] = {};
  for (int i = 0; i < kOrientationSamples; ++i) {
    const float turns = turns_of(responses.dx[i], responses.dy[i]);
    const int bin = std::min(static_cast<int>(turns * kBins), kBins - 1);
    dx[bin] += responses.dx[i];
    dy[bin] += responses.dy[i];
  }
  float best_length = -1, best_x = 0, best_y = 0;
  for (int start = 0; start < kBins; ++start) {
    float x = 0, y = 0;
    for (int i = 0; i < kWindowBins; ++i) {
      const int bin = start + i < kBins ? start + i : start + i - kBins;
      x += dx[bin];
      y += dy[bin];
    }
    const float length = x * x + y * y;
    if (length <= best_length) continue;
    best_length = length;
    best_x = x;
    best_y = y;
  }
  return std::atan2(best_y, best_x);
}

Descriptor surf_descriptor(const IntegralImage& integral, const Feature& feature, SurfEntries entries) {
  const int half = std::max(1, static_cast<int>(std::lround(feature.scale)));
  std::array<float, 64> v = haar_sums(
      integral, {feature.x, feature.y, feature.scale, std::cos(feature.angle), std::sin(feature.angle), half});
  if (entries == SurfEntries::roots)
    for (float& value : v) value = std::copysign(std::sqrt(std::abs(value)), value);
  float squared = 0;
  for (const float value : v) squared += value * value;
  const float scale = squared > 0 ? 254.0f / std::sqrt(squared) : 0.0f;
  Descriptor descriptor;
  for (std::size_t i = 0; i < v.size(); ++i) {
    descriptor.bytes[i] = static_cast<std::int8_t>(std::clamp(std::lround(v[i] * scale), -127L, 127L));
  }
  return descriptor;
}

Descriptor surf_descriptor(const IntegralImage& integral, const Feature& feature) {
  return surf_descriptor(integral, feature, SurfEntries::sums);
}

SurfDetector::SurfDetector(const DetectionOptions& options, ThreadPool workers)
    : options_(options), workers_(std::move(workers)), parts_(kSurfParts) {}

/// Rows or columns of the grid of an octave at which a filter of a layer lies inside the image, with a margin.
SurfDetector::Range SurfDetector::range_of(int octave, int layer, int length) {
  const int step = 1 << octave, margin = filter_size(octave, layer) / 2 + 1;
  return {(margin + step - 1) / step, length - 1 - margin < 0 ? -1 : (length - 1 - margin) / step};
}

/// det H of a row of the grid in all layers of an octave, into the ring of three rows of each layer.
void SurfDetector::compute_row(int octave, int y, ImageSize size, Image<float>& rows) const {
  const int step = 1 << octave;
  for (int layer = 0; layer < kLayersPerOctave; ++layer) {
    const Range column = range_of(octave, layer, size.width);
    if (!range_of(octave, layer, size.height).contains(y) || column.last < column.first) continue;
    hessian_row(integral_, y * step, column.first * step, column.last - column.first + 1, filter_size(octave, layer),
                step, rows.row(3 * layer + y % 3) + column.first);
  }
}

/// Maxima at a row of the grid, whose neighbours have been computed.
void SurfDetector::find_maxima(int octave, int y, ImageSize size, Part& part) const {
  const auto threshold = static_cast<float>(options_.surf.threshold);
  const int step = 1 << octave;
  const auto response = [&](int layer, int row) { return part.rows.row(3 * layer + row % 3); };
  for (int middle = 1; middle + 1 < kLayersPerOctave; ++middle) {
    // Room for the largest filter and a neighbour.
    const Range rows = range_of(octave, middle + 1, size.height), columns = range_of(octave, middle + 1, size.width);
    if (y <= rows.first || y >= rows.last) continue;
    part.columns.clear();
    maxima_of_row(response(middle, y - 1), response(middle, y), response(middle, y + 1), columns.first + 1,
                  columns.last - 1, threshold, part.columns);
    const int filter_px = filter_size(octave, middle), filter_step = filter_size(octave, middle + 1) - filter_px;
    for (const int x : part.columns) {
      Cube cube;
      for (int s = 0; s < 3; ++s)
        for (int j = 0; j < 3; ++j) std::copy_n(response(middle + s - 1, y + j - 1) + x - 1, 3, cube.v[s][j]);
      if (!cube.is_maximum()) continue;
      const Eigen::Vector3f peak = cube.peak();
      if (!(peak.cwiseAbs().maxCoeff() <= 1.0f)) continue;
      Feature f;
      f.x = (static_cast<float>(x) + peak.x()) * static_cast<float>(step);
      f.y = (static_cast<float>(y) + peak.y()) * static_cast<float>(step);
      f.scale = scale_of_filter(static_cast<float>(filter_px) + peak.z() * static_cast<float>(filter_step));
      f.strength = cube.v[1][1][1];
      const BoxHessian h = box_hessian(integral_, x * step, y * step, filter_px);
      f.sign = h.xx + h.yy >= 0 ? 1 : -1;
      part.found.push_back(f);
    }
  }
}

void SurfDetector::search(int index, ImageSize size, Part& part) const {
  part.found.clear();
  if (part.rows.width() < size.width + kRowRoom) part.rows = Image<float>(size.width + kRowRoom, 3 * kLayersPerOctave);
  for (int octave = 0; octave < options_.surf.octaves; ++octave) {
    const Range rows = range_of(octave, 0, size.height);
    const int count = std::max(0, rows.last - rows.first + 1);
    const int begin = rows.first + count * index / kSurfParts, end = rows.first + count * (index + 1) / kSurfParts;
    for (int y = begin - 1; y <= end; ++y) {
      compute_row(octave, y, size, part.rows);
      if (y > begin) find_maxima(octave, y - 1, size, part);
    }
  }
}

/// Refines some more features than are wanted, because not all have a maximum, and some share one.
void SurfDetector::refine(ImageView<const std::uint8_t> image, ImageView<const std::uint8_t> mask, int count,
                          const WantedFeatures& wanted) {
  const int more = count + count * kMoreToRefine_percent / 100 + kMoreToRefine;
  features_ = spread_features(found_, image.size(), more, options_.spacing_px, wanted.taken);
  refinement_.compute(image);
  workers_.parallel_for(0, static_cast<int>(features_.size()), 16, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      Feature& f = features_[static_cast<std::size_t>(i)];
      const std::optional<Feature> refined = refinement_.refined(f);
      f = refined.value_or(f);
      if (!refined) f.strength = -1;
    }
  });
  std::erase_if(features_, [](const Feature& f) { return f.strength < 0; });
  discard_masked(features_, mask);
  features_ = spread_features(features_, image.size(), count, options_.spacing_px, wanted.taken);
}

const std::vector<Feature>& SurfDetector::detect(ImageView<const std::uint8_t> image,
                                                 ImageView<const std::uint8_t> mask, const WantedFeatures& wanted) {
  integral_.compute(image);
  workers_.parallel_for(0, kSurfParts, 1,
                        [&](int begin, int) { search(begin, image.size(), parts_[static_cast<std::size_t>(begin)]); });
  found_.clear();
  for (const Part& part : parts_) found_.insert(found_.end(), part.found.begin(), part.found.end());
  discard_masked(found_, mask);
  const int count = wanted.count.value_or(options_.landmarks);
  if (options_.surf.refine) {
    refine(image, mask, count, wanted);
  } else {
    features_ = spread_features(found_, image.size(), count, options_.spacing_px, wanted.taken);
  }
  const SurfEntries entries = options_.surf.refine ? SurfEntries::roots : SurfEntries::sums;
  workers_.parallel_for(0, static_cast<int>(features_.size()), 64, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      Feature& f = features_[static_cast<std::size_t>(i)];
      if (!options_.surf.upright) f.angle = surf_orientation(integral_, f);
      f.descriptor = surf_descriptor(integral_, f, entries);
    }
  });
  return features_;
}

}  // namespace spartan::internal
