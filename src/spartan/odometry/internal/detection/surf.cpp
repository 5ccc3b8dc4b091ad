#include "spartan/odometry/internal/detection/surf.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "spartan/odometry/internal/detection/feature_spread.h"
#include "spartan/odometry/internal/detection/surf_kernels.h"

namespace spartan::internal {
namespace {

constexpr int kLayersPerOctave = 4;
/// Parts of the image that are searched in parallel.
constexpr int kSurfParts = 8;
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

/// Haar wavelet responses (dx, dy) of side 2·half at a pixel corner.
Eigen::Vector2f haar(const IntegralImage& integral, int x, int y, int half) {
  const auto sum = [&](int x0, int y0, int x1, int y1) {
    return static_cast<float>(static_cast<std::int32_t>(integral.clipped_box(x0, y0, x1, y1)));
  };
  const int l = x - half, r = x + half, t = y - half, b = y + half;
  return {sum(x, t, r, b) - sum(l, t, x, b), sum(l, y, r, b) - sum(l, t, r, y)};
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
  struct Response {
    float angle, dx, dy;
  };
  std::vector<Response> responses;
  const float s = feature.scale;
  const int half = std::max(1, static_cast<int>(std::lround(2 * s)));
  for (int j = -6; j <= 6; ++j) {
    for (int i = -6; i <= 6; ++i) {
      if (i * i + j * j >= 36) continue;
      const float weight = std::exp(-static_cast<float>(i * i + j * j) / (2 * 2.5f * 2.5f));
      const int x = static_cast<int>(std::lround(feature.x + static_cast<float>(i) * s));
      const int y = static_cast<int>(std::lround(feature.y + static_cast<float>(j) * s));
      const Eigen::Vector2f d = weight * haar(integral, x, y, half);
      responses.push_back({std::atan2(d.y(), d.x()), d.x(), d.y()});
    }
  }
  constexpr float kPi = 3.14159265f, kWindow = kPi / 3;
  float best_length = -1, best_angle = 0;
  for (float start = -kPi; start < kPi; start += 0.15f) {
    Eigen::Vector2f sum = Eigen::Vector2f::Zero();
    for (const Response& r : responses) {
      float ahead = r.angle - start;
      if (ahead < 0) ahead += 2 * kPi;
      if (ahead < kWindow) sum += Eigen::Vector2f(r.dx, r.dy);
    }
    if (sum.squaredNorm() > best_length) {
      best_length = sum.squaredNorm();
      best_angle = std::atan2(sum.y(), sum.x());
    }
  }
  return best_angle;
}

Descriptor surf_descriptor(const IntegralImage& integral, const Feature& feature) {
  const int half = std::max(1, static_cast<int>(std::lround(feature.scale)));
  const std::array<float, 64> v = haar_sums(
      integral, {feature.x, feature.y, feature.scale, std::cos(feature.angle), std::sin(feature.angle), half});
  float squared = 0;
  for (const float value : v) squared += value * value;
  const float scale = squared > 0 ? 254.0f / std::sqrt(squared) : 0.0f;
  Descriptor descriptor;
  for (std::size_t i = 0; i < v.size(); ++i) {
    descriptor.bytes[i] = static_cast<std::int8_t>(std::clamp(std::lround(v[i] * scale), -127L, 127L));
  }
  return descriptor;
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

const std::vector<Feature>& SurfDetector::detect(ImageView<const std::uint8_t> image,
                                                 ImageView<const std::uint8_t> mask, const WantedFeatures& wanted) {
  integral_.compute(image);
  workers_.parallel_for(0, kSurfParts, 1,
                        [&](int begin, int) { search(begin, image.size(), parts_[static_cast<std::size_t>(begin)]); });
  found_.clear();
  for (const Part& part : parts_) found_.insert(found_.end(), part.found.begin(), part.found.end());
  discard_masked(found_, mask);
  features_ = spread_features(found_, image.size(), wanted.count.value_or(options_.landmarks), options_.spacing_px,
                              wanted.taken);
  workers_.parallel_for(0, static_cast<int>(features_.size()), 64, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      Feature& f = features_[static_cast<std::size_t>(i)];
      if (!options_.surf.upright) f.angle = surf_orientation(integral_, f);
      f.descriptor = surf_descriptor(integral_, f);
    }
  });
  return features_;
}

}  // namespace spartan::internal
