#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "spartan/reconstruction/map_generator.h"

namespace spartan {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

constexpr int kRounds = 6;  // of least squares; the first has no robust weights

// Σ w r rᵀ, of which the decomposition reads the lower triangle only, and Σ w z r.
class NormalEquations {
 public:
  void add(const Vector6& row, double weight, double z) {
    const Vector6 weighted = weight * row;
    columns01_[0] += weighted * row[0];
    columns01_[1] += weighted * row[1];
    columns23_[0] += weighted.tail<4>() * row[2];
    columns23_[1] += weighted.tail<4>() * row[3];
    columns45_[0] += weighted.tail<2>() * row[4];
    columns45_[1] += weighted.tail<2>() * row[5];
    right_ += weight * z * row;
  }
  Vector6 solve() const {
    Matrix6 a = Matrix6::Zero();
    for (int i = 0; i < 2; ++i) {
      a.col(i) = columns01_[static_cast<std::size_t>(i)];
      a.col(2 + i).tail<4>() = columns23_[static_cast<std::size_t>(i)];
      a.col(4 + i).tail<2>() = columns45_[static_cast<std::size_t>(i)];
    }
    return a.ldlt().solve(right_);
  }

 private:
  static constexpr double kRidge = 1e-6;
  std::array<Vector6, 2> columns01_{kRidge * Vector6::Unit(0), kRidge* Vector6::Unit(1)};
  std::array<Eigen::Vector4d, 2> columns23_{kRidge * Eigen::Vector4d::Unit(0), kRidge* Eigen::Vector4d::Unit(1)};
  std::array<Eigen::Vector2d, 2> columns45_{kRidge * Eigen::Vector2d::Unit(0), kRidge* Eigen::Vector2d::Unit(1)};
  Vector6 right_ = Vector6::Zero();
};

class GroundFit {
 public:
  GroundFit(ImageView<const float> elevation, ImageView<const std::uint8_t> ground, double cell_m,
            const GroundSurfaceOptions& options)
      : elevation_(elevation),
        ground_(ground),
        options_(options),
        radius_(std::max(2, static_cast<int>(std::lround(0.5 * options.window_m / cell_m)))) {}

  // A known cell of the window.
  struct Sample {
    Vector6 row;  // 1, u, v, u², uv, v²
    double z = 0, weight = 0;
  };

  // Elevation of the ground surface at a cell: z = s₀ + s₁u + s₂v + s₃u² + s₄uv + s₅v² with u = v = 0 there. `samples`
  // is a buffer.
  float at(int x, int y, std::vector<Sample>& samples) const {
    collect(x, y, samples);
    if (samples.size() < 6) return std::numeric_limits<float>::quiet_NaN();
    Vector6 surface = Vector6::Zero();
    double scale = options_.initial_scale_m;
    const double step = std::pow(options_.final_scale_m / options_.initial_scale_m, 1.0 / (kRounds - 2));
    for (int round = 0; round < kRounds; ++round) {
      NormalEquations equations;
      for (const Sample& sample : samples) {
        double weight = sample.weight;
        if (round > 0) {
          const double r = (sample.z - sample.row.dot(surface)) / scale, t = 1 + r * r;
          weight /= t * t;
        }
        equations.add(sample.row, weight, sample.z);
      }
      surface = equations.solve();
      if (round > 0) scale = std::max(scale * step, options_.final_scale_m);
    }
    return static_cast<float>(surface[0]);
  }

 private:
  // The known cells of the window around a cell; the same for all rounds.
  void collect(int x, int y, std::vector<Sample>& samples) const {
    samples.clear();
    for (int j = std::max(y - radius_, 0); j <= std::min(y + radius_, elevation_.height() - 1); ++j) {
      for (int i = std::max(x - radius_, 0); i <= std::min(x + radius_, elevation_.width() - 1); ++i) {
        const double z = elevation_(i, j);
        if (!std::isfinite(z)) continue;
        const double u = static_cast<double>(i - x) / radius_, v = static_cast<double>(j - y) / radius_;
        if (u * u + v * v > 1) continue;
        const double weight = (1 - u * u - v * v) * (ground_(i, j) != 0 ? 1.0 : options_.non_ground_weight);
        samples.push_back({Vector6{1, u, v, u * u, u * v, v * v}, z, weight});
      }
    }
  }

  ImageView<const float> elevation_;
  ImageView<const std::uint8_t> ground_;
  const GroundSurfaceOptions& options_;
  int radius_;
};

// Bilinear interpolation between the nodes; unknown nodes have no weight.
float interpolated(const Image<float>& nodes, double u, double v) {
  const int i = std::clamp(static_cast<int>(u), 0, nodes.width() - 2),
            j = std::clamp(static_cast<int>(v), 0, nodes.height() - 2);
  const double a = u - i, b = v - j;
  double sum = 0, weights = 0;
  for (int k = 0; k < 4; ++k) {
    const float z = nodes(i + (k & 1), j + (k >> 1));
    if (!std::isfinite(z)) continue;
    const double weight = ((k & 1) != 0 ? a : 1 - a) * ((k >> 1) != 0 ? b : 1 - b) + 1e-9;
    sum += weight * z;
    weights += weight;
  }
  return weights > 0 ? static_cast<float>(sum / weights) : std::numeric_limits<float>::quiet_NaN();
}

}  // namespace

Image<float> fit_ground(ImageView<const float> elevation_m, ImageView<const std::uint8_t> ground, double cell_m,
                        const GroundSurfaceOptions& options, const ThreadPool& workers) {
  const auto [w, h] = elevation_m.size();
  const int step = std::max(1, static_cast<int>(std::lround(options.node_spacing_m / cell_m)));
  const GroundFit fit(elevation_m, ground, cell_m, options);
  Image<float> nodes(std::max(2, (w - 1) / step + 2), std::max(2, (h - 1) / step + 2));
  workers.parallel_for(0, nodes.height(), 1, [&](int from, int to) {
    std::vector<GroundFit::Sample> samples;
    for (int j = from; j < to; ++j) {
      for (int i = 0; i < nodes.width(); ++i) nodes(i, j) = fit.at(i * step, j * step, samples);
    }
  });
  Image<float> result(w, h);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x)
      result(x, y) = interpolated(nodes, static_cast<double>(x) / step, static_cast<double>(y) / step);
  }
  return result;
}

}  // namespace spartan
