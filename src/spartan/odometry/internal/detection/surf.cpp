#include "spartan/odometry/internal/detection/surf.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "spartan/odometry/internal/detection/feature_spread.h"

namespace spartan::internal {
namespace {

constexpr int kLayersPerOctave = 4;
constexpr int kSurfRowsPerPart = 16;

/// Filter sides 9, 15, 21, 27 / 15, 27, 39, 51 / … (§3.3).
int filter_size(int octave, int layer) {
  return 3 * ((2 << octave) * (layer + 1) + 1);
}

/// Blob scale of a filter: the 9-px filter approximates Gaussian derivatives of σ = 1.2 px (§3.2).
float scale_of_filter(float filter_px) {
  return 1.2f * filter_px / 9.0f;
}

/// One row of determinants at x = x0, x0 + Step, … The row pointers of the integral image are computed once, so that
/// the loop runs over contiguous memory and can be vectorized.
template <int Step>
void hessian_row(const IntegralImage& integral, int y, int x0, int count, int filter_px, float* out) {
  const int lobe = filter_px / 3, half = filter_px / 2;
  const float area = 1.0f / static_cast<float>(filter_px * filter_px);
  const std::uint32_t* xx_top = integral.row(y - lobe + 1) + x0;
  const std::uint32_t* xx_bottom = integral.row(y + lobe) + x0;
  const std::uint32_t* yy_top = integral.row(y - half) + x0;
  const std::uint32_t* yy_upper = integral.row(y - lobe / 2) + x0;
  const std::uint32_t* yy_lower = integral.row(y + lobe / 2 + 1) + x0;
  const std::uint32_t* yy_bottom = integral.row(y + half + 1) + x0;
  const std::uint32_t* xy_top = integral.row(y - lobe) + x0;
  const std::uint32_t* middle_above = integral.row(y) + x0;
  const std::uint32_t* middle_below = integral.row(y + 1) + x0;
  const std::uint32_t* xy_bottom = integral.row(y + lobe + 1) + x0;
  const int inner = lobe / 2;
  for (int i = 0; i < count; ++i) {
    const int x = i * Step;
    const auto span = [x](const std::uint32_t* top, const std::uint32_t* bottom, int from, int to) {
      return static_cast<std::int32_t>(bottom[x + to] - bottom[x + from] - top[x + to] + top[x + from]);
    };
    const std::int32_t xx = span(xx_top, xx_bottom, -half, half + 1) - 3 * span(xx_top, xx_bottom, -inner, inner + 1);
    const std::int32_t yy = span(yy_top, yy_bottom, -lobe + 1, lobe) - 3 * span(yy_upper, yy_lower, -lobe + 1, lobe);
    const std::int32_t xy = span(xy_top, middle_above, 1, lobe + 1) + span(middle_below, xy_bottom, -lobe, 0) -
                            span(xy_top, middle_above, -lobe, 0) - span(middle_below, xy_bottom, 1, lobe + 1);
    const BoxHessian h{static_cast<float>(xx) * area, static_cast<float>(yy) * area, static_cast<float>(xy) * area};
    out[i] = h.determinant();
  }
}

void hessian_row(const IntegralImage& integral, int y, int x0, int count, int filter_px, int step, float* out) {
  switch (step) {
    case 1:
      return hessian_row<1>(integral, y, x0, count, filter_px, out);
    case 2:
      return hessian_row<2>(integral, y, x0, count, filter_px, out);
    case 4:
      return hessian_row<4>(integral, y, x0, count, filter_px, out);
    case 8:
      return hessian_row<8>(integral, y, x0, count, filter_px, out);
    default:
      return hessian_row<16>(integral, y, x0, count, filter_px, out);
  }
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
  const float s = feature.scale, co = std::cos(feature.angle), si = std::sin(feature.angle);
  const int half = std::max(1, static_cast<int>(std::lround(s)));
  std::array<float, 64> v{};
  for (int j = 0; j < 20; ++j) {
    for (int i = 0; i < 20; ++i) {
      const float a = static_cast<float>(i) - 9.5f, b = static_cast<float>(j) - 9.5f;  // in units of s
      const int x = static_cast<int>(std::lround(feature.x + 0.5f + s * (co * a - si * b)));
      const int y = static_cast<int>(std::lround(feature.y + 0.5f + s * (si * a + co * b)));
      const float weight = std::exp(-(a * a + b * b) / (2 * 3.3f * 3.3f));
      const Eigen::Vector2f d = weight * haar(integral, x, y, half);
      const float dx = co * d.x() + si * d.y(), dy = co * d.y() - si * d.x();
      float* subregion = &v[static_cast<std::size_t>(4 * ((j / 5) * 4 + i / 5))];
      subregion[0] += dx;
      subregion[1] += std::abs(dx);
      subregion[2] += dy;
      subregion[3] += std::abs(dy);
    }
  }
  float squared = 0;
  for (const float value : v) squared += value * value;
  const float scale = squared > 0 ? 254.0f / std::sqrt(squared) : 0.0f;
  Descriptor descriptor;
  for (std::size_t i = 0; i < v.size(); ++i) {
    descriptor[i] = static_cast<std::int8_t>(std::clamp(std::lround(v[i] * scale), -127L, 127L));
  }
  return descriptor;
}

SurfDetector::SurfDetector(const DetectionOptions& options, ThreadPool workers)
    : options_(options), workers_(std::move(workers)) {
  for (int octave = 0; octave < options_.surf.octaves; ++octave) {
    for (int layer = 0; layer < kLayersPerOctave; ++layer) {
      layers_.push_back({filter_size(octave, layer), 1 << octave, {}});
    }
  }
}

void SurfDetector::compute_layers(ImageSize size) {
  for (Layer& layer : layers_) {
    const int step = layer.step_px, margin = layer.filter_px / 2 + 1;
    const ImageSize grid{(size.width + step - 1) / step, (size.height + step - 1) / step};
    if (layer.response.size() != grid) layer.response = Image<float>(grid);
    const int first = (margin + step - 1) / step;
    const int columns = (size.width - 1 - margin) / step - first + 1;
    const int rows = (size.height - 1 - margin) / step - first + 1;
    if (columns <= 0 || rows <= 0) continue;
    workers_.parallel_for(first, first + rows, kSurfRowsPerPart, [&](int begin, int end) {
      for (int r = begin; r < end; ++r) {
        hessian_row(integral_, r * step, first * step, columns, layer.filter_px, step, layer.response.row(r) + first);
      }
    });
  }
}

std::vector<Feature> SurfDetector::find_maxima(ImageSize size) const {
  std::vector<Feature> found;
  const auto threshold = static_cast<float>(options_.surf.threshold);
  for (int octave = 0; octave < options_.surf.octaves; ++octave) {
    for (int middle = 1; middle + 1 < kLayersPerOctave; ++middle) {
      const Layer* layer = &layers_[static_cast<std::size_t>(octave * kLayersPerOctave + middle)];
      const int step = layer->step_px, filter_step = layer[1].filter_px - layer[0].filter_px;
      const int first =
          (layer[1].filter_px / 2 + 1 + step - 1) / step + 1;  // room for the largest filter and a neighbour
      const int last_x = (size.width - 1 - layer[1].filter_px / 2 - 1) / step - 1;
      const int last_y = (size.height - 1 - layer[1].filter_px / 2 - 1) / step - 1;
      for (int y = first; y <= last_y; ++y) {
        const float *row = layer->response.row(y), *up = layer->response.row(y - 1), *down = layer->response.row(y + 1);
        for (int x = first; x <= last_x; ++x) {
          const float centre = row[x];
          // Cheap tests first; most pixels fail one of them.
          if (!(centre > threshold && centre > row[x - 1] && centre > row[x + 1] && centre > up[x] && centre > down[x]))
            continue;
          Cube cube;
          for (int s = 0; s < 3; ++s)
            for (int j = 0; j < 3; ++j) std::copy_n(layer[s - 1].response.row(y + j - 1) + x - 1, 3, cube.v[s][j]);
          if (!cube.is_maximum()) continue;
          const Eigen::Vector3f peak = cube.peak();
          if (!(peak.cwiseAbs().maxCoeff() <= 1.0f)) continue;
          Feature f;
          f.x = (static_cast<float>(x) + peak.x()) * static_cast<float>(step);
          f.y = (static_cast<float>(y) + peak.y()) * static_cast<float>(step);
          f.scale = scale_of_filter(static_cast<float>(layer->filter_px) + peak.z() * static_cast<float>(filter_step));
          f.strength = centre;
          const BoxHessian h = box_hessian(integral_, x * step, y * step, layer->filter_px);
          f.sign = h.xx + h.yy >= 0 ? 1 : -1;
          found.push_back(f);
        }
      }
    }
  }
  return found;
}

const std::vector<Feature>& SurfDetector::detect(ImageView<const std::uint8_t> image,
                                                 ImageView<const std::uint8_t> mask) {
  integral_.compute(image);
  compute_layers(image.size());
  std::vector<Feature> found = find_maxima(image.size());
  if (!mask.empty()) {
    std::erase_if(found, [&](const Feature& f) {
      const int x = static_cast<int>(std::lround(f.x)), y = static_cast<int>(std::lround(f.y));
      return !mask.contains(x, y) || mask(x, y) == 0;
    });
  }
  features_ = spread_features(std::move(found), image.size(), options_.landmarks, options_.spacing_px);
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
