#include "spartan/odometry/internal/matching/patch_alignment.h"

#include <Eigen/Dense>
#include <cmath>

#include "spartan/odometry/internal/matching/smoothed_image.h"

namespace spartan::internal {
namespace {

constexpr int kMaxIterations = 15;
/// The iteration has converged where a step is smaller than this.
constexpr double kConverged_px = 0.005;
/// Smoothing correlates the noise of neighbouring pixels: the variance of a sum over many of them is the variance of
/// one pixel divided by Σ kernel² = (70/256)² of the binomial filter [1 4 6 4 1]/16 in two dimensions.
constexpr double kNoiseCorrelation = 1.0 / ((70.0 / 256.0) * (70.0 / 256.0));
/// Effective number of pixels under the Gaussian window: about half of its area.
constexpr double kEffectivePixels = 0.5 * kWindowArea;
/// Minimum standard deviation of a window with usable texture, gray levels.
constexpr float kMinDeviation = 0.5f;
/// Minimum information (mean squared gradient, gray levels² per pixel²) in one direction, and its determinant in two;
/// empirical.
constexpr double kMinInformation = 1e-2, kMinDeterminant = 1e-4;
/// Minimum determinant of a warp: patches that are compressed more are not aligned; empirical.
constexpr double kMinWarpDeterminant = 0.05;
/// Prior on the slant: σ = 0.4 px/px against a noise of about 4 gray levels (before smoothing).
constexpr double kSlantPrior = 16.0 / (0.4 * 0.4);
/// Information that fixes the slant where it is not estimated.
constexpr double kFixedSlant = 1e12;
/// Largest slant along and across the row (px/px); a larger one is a wrong match; empirical.
constexpr double kMaxSlantX = 0.8, kMaxSlantY = 1.5;
/// Standard deviation of the Gaussian window, pixels.
constexpr float kWindowSigma_px = 4.0f;
/// Weight of a step of the slant against one of the position in the convergence test: about the extent of the window.
constexpr double kSlantLever_px = 3;

using Window = std::array<float, kWindowArea>;

/// Gaussian weights over the window with sum 1.
const Window& window_weights() {
  static const Window weights = [] {
    Window w{};
    float sum = 0;
    for (int y = 0, i = 0; y < kWindowSide; ++y) {
      for (int x = 0; x < kWindowSide; ++x, ++i) {
        const int dx = x - kWindowRadius, dy = y - kWindowRadius;
        w[static_cast<std::size_t>(i)] =
            std::exp(-static_cast<float>(dx * dx + dy * dy) / (2 * kWindowSigma_px * kWindowSigma_px));
        sum += w[static_cast<std::size_t>(i)];
      }
    }
    for (float& value : w) value /= sum;
    return w;
  }();
  return weights;
}

/// Subtracts the weighted mean and returns the weighted standard deviation.
float subtract_mean(Window& window) {
  const Window& w = window_weights();
  float mean = 0;
  for (std::size_t i = 0; i < kWindowArea; ++i) mean += w[i] * window[i];
  float variance = 0;
  for (std::size_t i = 0; i < kWindowArea; ++i) {
    window[i] -= mean;
    variance += w[i] * window[i] * window[i];
  }
  return std::sqrt(variance);
}

float weighted_dot(const Window& a, const Window& b) {
  const Window& w = window_weights();
  float sum = 0;
  for (std::size_t i = 0; i < kWindowArea; ++i) sum += w[i] * a[i] * b[i];
  return sum;
}

/// Samples the image over the warped window; std::nullopt where a corner leaves the image.
std::optional<Window> warped_window(ImageView<const std::uint16_t> image, const Eigen::Matrix2d& warp,
                                    const Eigen::Vector2d& centre) {
  const double radius_x = kWindowRadius * (std::abs(warp(0, 0)) + std::abs(warp(0, 1)));
  const double radius_y = kWindowRadius * (std::abs(warp(1, 0)) + std::abs(warp(1, 1)));
  if (!(centre.x() - radius_x >= 0 && centre.x() + radius_x < image.width() - 1.01 && centre.y() - radius_y >= 0 &&
        centre.y() + radius_y < image.height() - 1.01)) {
    return std::nullopt;
  }
  Window window;
  const Eigen::Matrix2f a = warp.cast<float>();
  const Eigen::Vector2f c = centre.cast<float>();
  std::size_t i = 0;
  for (int y = -kWindowRadius; y <= kWindowRadius; ++y) {
    const auto fy = static_cast<float>(y);
    for (int x = -kWindowRadius; x <= kWindowRadius; ++x, ++i) {
      const auto fx = static_cast<float>(x);
      window[i] = sample(image, c.x() + a(0, 0) * fx + a(0, 1) * fy, c.y() + a(1, 0) * fx + a(1, 1) * fy);
    }
  }
  return window;
}

/// Difference of an image window to a template, after matching mean and contrast.
struct WindowDifference {
  Window observed, residual;
  float deviation;
  double correlation(const AlignmentTemplate& reference) const {
    return weighted_dot(observed, reference.value) / (deviation * reference.deviation);
  }
  double variance() const { return weighted_dot(residual, residual); }
};

/// std::nullopt where the window leaves the image or has no texture.
std::optional<WindowDifference> difference_from(const AlignmentTemplate& reference,
                                                ImageView<const std::uint16_t> image, const Eigen::Matrix2d& warp,
                                                const Eigen::Vector2d& centre) {
  const std::optional<Window> observed = warped_window(image, warp, centre);
  if (!observed) return std::nullopt;
  WindowDifference difference{*observed, {}, 0};
  difference.deviation = subtract_mean(difference.observed);
  if (difference.deviation < kMinDeviation) return std::nullopt;
  const float contrast = reference.deviation / difference.deviation;
  for (std::size_t i = 0; i < kWindowArea; ++i)
    difference.residual[i] = contrast * difference.observed[i] - reference.value[i];
  return difference;
}

/// Weighted mean of JᵀJ over the window, J given by its columns.
template <std::size_t Unknowns>
Eigen::Matrix<double, Unknowns, Unknowns> information_of(const std::array<Window, Unknowns>& j) {
  Eigen::Matrix<double, Unknowns, Unknowns> information;
  for (std::size_t a = 0; a < Unknowns; ++a) {
    for (std::size_t b = a; b < Unknowns; ++b) {
      const auto row = static_cast<Eigen::Index>(a), column = static_cast<Eigen::Index>(b);
      information(row, column) = information(column, row) = weighted_dot(j[a], j[b]);
    }
  }
  return information;
}

/// Weighted mean of Jᵀr over the window.
template <std::size_t Unknowns>
Eigen::Matrix<double, Unknowns, 1> gradient_of(const std::array<Window, Unknowns>& j, const Window& residual) {
  Eigen::Matrix<double, Unknowns, 1> gradient;
  for (std::size_t a = 0; a < Unknowns; ++a) gradient[static_cast<Eigen::Index>(a)] = weighted_dot(j[a], residual);
  return gradient;
}

}  // namespace

std::optional<ImagePatch> cut_patch(ImageView<const std::uint16_t> image, int x, int y) {
  constexpr int r = kWindowRadius + 1;
  if (x < r || y < r || x + r >= image.width() || y + r >= image.height()) return std::nullopt;
  ImagePatch patch;
  for (int j = 0; j < kPatchSide; ++j) {
    std::copy_n(image.row(y - r + j) + x - r, kPatchSide, patch.begin() + j * kPatchSide);
  }
  return patch;
}

AlignmentTemplate::AlignmentTemplate(const std::array<float, kPatchSide * kPatchSide>& pixels) {
  std::size_t i = 0;
  for (int y = 1; y <= kWindowSide; ++y) {
    for (int x = 1; x <= kWindowSide; ++x, ++i) {
      const float* p = &pixels[static_cast<std::size_t>(y * kPatchSide + x)];
      value[i] = p[0];
      gradient_x[i] = 0.5f * (p[1] - p[-1]);
      gradient_y[i] = 0.5f * (p[kPatchSide] - p[-kPatchSide]);
    }
  }
  deviation = subtract_mean(value);
}

AlignmentTemplate::AlignmentTemplate(const ImagePatch& patch)
    : AlignmentTemplate([&] {
        std::array<float, kPatchSide * kPatchSide> pixels;
        for (std::size_t i = 0; i < pixels.size(); ++i) pixels[i] = static_cast<float>(patch[i]) * (1.0f / 256.0f);
        return pixels;
      }()) {}

std::optional<AlignmentTemplate> AlignmentTemplate::around(ImageView<const std::uint16_t> image,
                                                           const Eigen::Vector2d& centre) {
  constexpr int r = kWindowRadius + 1;
  if (!(centre.x() >= r && centre.y() >= r && centre.x() + r < image.width() - 1.01 &&
        centre.y() + r < image.height() - 1.01)) {
    return std::nullopt;
  }
  std::array<float, kPatchSide * kPatchSide> pixels;
  const Eigen::Vector2f c = centre.cast<float>();
  std::size_t i = 0;
  for (int y = -r; y <= r; ++y) {
    for (int x = -r; x <= r; ++x, ++i)
      pixels[i] = sample(image, c.x() + static_cast<float>(x), c.y() + static_cast<float>(y));
  }
  return AlignmentTemplate(pixels);
}

std::optional<PatchAlignment> align_translation(const AlignmentTemplate& reference,
                                                ImageView<const std::uint16_t> image, const Eigen::Matrix2d& warp,
                                                const Eigen::Vector2d& start, double radius_px) {
  if (reference.deviation < kMinDeviation || !(std::abs(warp.determinant()) > kMinWarpDeterminant)) return std::nullopt;
  // At the solution ∇image = warp⁻ᵀ ∇template, so the Jacobian is computed once, from the template.
  const Eigen::Matrix2f to_image = warp.inverse().transpose().cast<float>();
  std::array<Window, 2> j;
  for (std::size_t i = 0; i < kWindowArea; ++i) {
    j[0][i] = to_image(0, 0) * reference.gradient_x[i] + to_image(0, 1) * reference.gradient_y[i];
    j[1][i] = to_image(1, 0) * reference.gradient_x[i] + to_image(1, 1) * reference.gradient_y[i];
  }
  for (Window& window : j) subtract_mean(window);  // projects out the unknown brightness
  const Eigen::Matrix2d information = information_of(j);
  if (!(information.determinant() > kMinDeterminant)) return std::nullopt;
  const Eigen::Matrix2d inverse = information.inverse();

  Eigen::Vector2d position = start;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const auto difference = difference_from(reference, image, warp, position);
    if (!difference) return std::nullopt;
    const Eigen::Vector2d step = -(inverse * gradient_of(j, difference->residual));
    position += step;
    if (!((position - start).norm() <= radius_px)) return std::nullopt;
    if (step.norm() > kConverged_px) continue;
    const double variance = difference->variance();
    PatchAlignment found;
    found.position = position;
    found.correlation = difference->correlation(reference);
    // `information` is a mean over the window; the sum over independent pixels is larger by their number.
    found.covariance = inverse * (variance * kNoiseCorrelation / kEffectivePixels);
    return found;
  }
  return std::nullopt;
}

std::optional<RowAlignment> align_along_row(const AlignmentTemplate& reference, ImageView<const std::uint16_t> right,
                                            const Eigen::Vector2d& centre, const RowAlignment& start,
                                            bool estimate_slant, double radius_px) {
  if (reference.deviation < kMinDeviation) return std::nullopt;
  // right(x − d − s·offset) ≈ template(x): the derivative by d is −∂x, by the slant −offset ∂x.
  std::array<Window, 3> j;
  for (std::size_t i = 0; i < kWindowArea; ++i) {
    const int column = static_cast<int>(i) % kWindowSide, row = static_cast<int>(i) / kWindowSide;
    j[0][i] = -reference.gradient_x[i];
    j[1][i] = j[0][i] * static_cast<float>(column - kWindowRadius);
    j[2][i] = j[0][i] * static_cast<float>(row - kWindowRadius);
  }
  for (Window& window : j) subtract_mean(window);
  Eigen::Matrix3d information = information_of(j);
  if (!(information(0, 0) > kMinInformation)) return std::nullopt;
  const double prior = kSlantPrior * kNoiseCorrelation / kEffectivePixels;
  information(1, 1) += prior;
  information(2, 2) += prior;
  if (!estimate_slant) {
    const double alone = information(0, 0);
    information = Eigen::Vector3d(alone, kFixedSlant, kFixedSlant).asDiagonal();
  }
  const Eigen::Matrix3d inverse = information.inverse();

  Eigen::Vector3d x(start.disparity, start.slant.x(), start.slant.y());
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    Eigen::Matrix2d warp;
    warp << 1 - x[1], -x[2], 0, 1;
    const auto difference = difference_from(reference, right, warp, centre - Eigen::Vector2d(x[0], 0));
    if (!difference) return std::nullopt;
    Eigen::Vector3d gradient = gradient_of(j, difference->residual);
    gradient[1] += prior * (x[1] - start.slant.x());
    gradient[2] += prior * (x[2] - start.slant.y());
    const Eigen::Vector3d step = -(inverse * gradient);
    x += step;
    if (!(std::abs(x[0] - start.disparity) <= radius_px) || !(std::abs(x[1]) < kMaxSlantX) ||
        !(std::abs(x[2]) < kMaxSlantY)) {
      return std::nullopt;
    }
    if (std::abs(step[0]) + kSlantLever_px * std::abs(step[1]) + kSlantLever_px * std::abs(step[2]) > 2 * kConverged_px)
      continue;
    RowAlignment found;
    found.disparity = x[0];
    found.slant = {x[1], x[2]};
    found.correlation = difference->correlation(reference);
    const double variance = difference->variance();
    found.sigma_px = std::sqrt(inverse(0, 0) * variance * kNoiseCorrelation / kEffectivePixels);
    return found;
  }
  return std::nullopt;
}

std::optional<SlantedAlignment> align_slanted(const AlignmentTemplate& reference, ImageView<const std::uint16_t> right,
                                              const Eigen::Vector2d& start, double radius_px) {
  if (reference.deviation < kMinDeviation) return std::nullopt;
  // right(c + (ox − s·o, oy)) ≈ template: the derivative by c is the gradient, by the slant −offset ∂x.
  std::array<Window, 4> j;
  for (std::size_t i = 0; i < kWindowArea; ++i) {
    const int column = static_cast<int>(i) % kWindowSide, row = static_cast<int>(i) / kWindowSide;
    j[0][i] = reference.gradient_x[i];
    j[1][i] = reference.gradient_y[i];
    j[2][i] = -reference.gradient_x[i] * static_cast<float>(column - kWindowRadius);
    j[3][i] = -reference.gradient_x[i] * static_cast<float>(row - kWindowRadius);
  }
  for (Window& window : j) subtract_mean(window);
  Eigen::Matrix4d information = information_of(j);
  if (!(information.topLeftCorner<2, 2>().determinant() > kMinDeterminant)) return std::nullopt;
  const double prior = kSlantPrior * kNoiseCorrelation / kEffectivePixels;
  information(2, 2) += prior;
  information(3, 3) += prior;
  const Eigen::Matrix4d inverse = information.inverse();

  Eigen::Vector4d x(start.x(), start.y(), 0, 0);
  for (int iteration = 0; iteration < 2 * kMaxIterations; ++iteration) {
    Eigen::Matrix2d warp;
    warp << 1 - x[2], -x[3], 0, 1;
    const auto difference = difference_from(reference, right, warp, x.head<2>());
    if (!difference) return std::nullopt;
    Eigen::Vector4d gradient = gradient_of(j, difference->residual);
    gradient.tail<2>() += prior * x.tail<2>();
    const Eigen::Vector4d step = -(inverse * gradient);
    x += step;
    if (!((x.head<2>() - start).norm() <= radius_px) || !(std::abs(x[2]) < kMaxSlantX) ||
        !(std::abs(x[3]) < kMaxSlantY)) {
      return std::nullopt;
    }
    if (step.head<2>().norm() + kSlantLever_px * step.tail<2>().norm() > 2 * kConverged_px) continue;
    const double variance = difference->variance();
    SlantedAlignment found;
    found.match.position = x.head<2>();
    found.match.correlation = difference->correlation(reference);
    found.match.covariance = inverse.topLeftCorner<2, 2>() * (variance * kNoiseCorrelation / kEffectivePixels);
    found.slant = x.tail<2>();
    return found;
  }
  return std::nullopt;
}

}  // namespace spartan::internal
