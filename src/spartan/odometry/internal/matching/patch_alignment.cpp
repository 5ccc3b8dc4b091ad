#include "spartan/odometry/internal/matching/patch_alignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "spartan/odometry/internal/matching/projected_jacobian.h"

namespace spartan::internal {
namespace {

constexpr int kMaxIterations = 15;
/// The iteration has converged where a step is smaller than this.
constexpr double kConverged_px = 0.005;
/// Smoothing correlates the noise of neighbouring pixels: the variance of a sum over many of them is the variance of
/// one pixel divided by Σ kernel² = (70/256)² of the binomial filter [1 4 6 4 1]/16 in two dimensions.
constexpr double kNoiseCorrelation = 1.0 / ((70.0 / 256.0) * (70.0 / 256.0));
/// What is left of it without the low frequencies, which are projected out with planes and the scale (Monte Carlo:
/// PatchAlignment.CovarianceCoversTheErrors).
constexpr double kHighFrequencyNoise = 0.8;
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
/// Weight of a step of the slant against one of the position in the convergence test: about the extent of the window.
constexpr double kSlantLever_px = 3;

/// Windows keep this distance from the border of the image, so that rounding of their places does not pass it.
constexpr double kBorder_px = 0.01;

/// The window around `centre` under a warp; std::nullopt where a corner leaves the image.
std::optional<WindowPlace> place_of(ImageView<const std::uint16_t> image, const Eigen::Matrix2d& warp,
                                    const Eigen::Vector2d& centre) {
  const double radius_x = kWindowRadius * (std::abs(warp(0, 0)) + std::abs(warp(0, 1)));
  const double radius_y = kWindowRadius * (std::abs(warp(1, 0)) + std::abs(warp(1, 1)));
  if (!(centre.x() - radius_x >= kBorder_px && centre.x() + radius_x < image.width() - 1 - kBorder_px &&
        centre.y() - radius_y >= kBorder_px && centre.y() + radius_y < image.height() - 1 - kBorder_px)) {
    return std::nullopt;
  }
  const Eigen::Matrix2f a = warp.cast<float>();
  return WindowPlace{image,  static_cast<float>(centre.x()), static_cast<float>(centre.y()), a(0, 0), a(0, 1), a(1, 0),
                     a(1, 1)};
}

/// Difference of an image window to a template, after matching mean and contrast.
template <int Unknowns>
struct WindowDifference {
  double correlation = 0, variance = 0;         ///< variance: Σ w r²
  Eigen::Matrix<double, Unknowns, 1> gradient;  ///< Σ w Jᵀr
};

/// std::nullopt where the window leaves the image or has no texture.
template <int Unknowns>
std::optional<WindowDifference<Unknowns>> difference_from(const AlignmentTemplate& reference,
                                                          const ProjectedJacobian& jacobian,
                                                          ImageView<const std::uint16_t> image,
                                                          const Eigen::Matrix2d& warp, const Eigen::Vector2d& centre) {
  const std::optional<WindowPlace> place = place_of(image, warp, centre);
  if (!place) return std::nullopt;
  const WindowSums sums = window_sums(*place, reference.level, jacobian.factors.data(), Unknowns + 1);
  const float deviation = std::sqrt(std::max(0.0f, sums.square - sums.mean * sums.mean));
  if (deviation < kMinDeviation) return std::nullopt;
  const double contrast = reference.deviation / deviation;
  WindowDifference<Unknowns> difference;
  difference.correlation = sums.products[0] / (deviation * reference.deviation);
  difference.variance = 2.0 * reference.deviation * reference.deviation * std::max(0.0, 1 - difference.correlation);
  for (int a = 0; a < Unknowns; ++a) {
    difference.gradient[a] = contrast * sums.products[static_cast<std::size_t>(a) + 1];
  }
  return difference;
}

}  // namespace

std::optional<ImagePatch> cut_patch(ImageView<const std::uint16_t> image, int x, int y) {
  constexpr int r = kWindowRadius + 1;
  if (x < r || y < r || x + r >= image.width() || y + r >= image.height()) return std::nullopt;
  ImagePatch patch{};
  for (int j = 0; j < kPatchSide; ++j)
    std::copy_n(image.row(y - r + j) + x - r, kPatchSide, patch.begin() + j * kWindowStride);
  return patch;
}

AlignmentTemplate::AlignmentTemplate(const WindowGradients& gradients) : window(gradients) {
  const WindowStatistics statistics = subtract_mean(window.value);
  level = statistics.mean;
  deviation = std::sqrt(statistics.variance);
}

AlignmentTemplate::AlignmentTemplate(const ImagePatch& patch) : AlignmentTemplate(patch_gradients(patch.data())) {}

std::optional<AlignmentTemplate> AlignmentTemplate::around(ImageView<const std::uint16_t> image,
                                                           const Eigen::Vector2d& centre) {
  constexpr int r = kWindowRadius + 1;
  if (!(centre.x() >= r && centre.y() >= r && centre.x() + r < image.width() - 1.01 &&
        centre.y() + r < image.height() - 1.01)) {
    return std::nullopt;
  }
  return AlignmentTemplate(window_gradients(image, static_cast<float>(centre.x()), static_cast<float>(centre.y())));
}

std::optional<PatchAlignment> align_translation(const AlignmentTemplate& reference,
                                                ImageView<const std::uint16_t> image, const Eigen::Matrix2d& warp,
                                                const Eigen::Vector2d& start, double radius_px) {
  if (reference.deviation < kMinDeviation || !(std::abs(warp.determinant()) > kMinWarpDeterminant)) return std::nullopt;
  // At the solution ∇image = warp⁻ᵀ ∇template, so the Jacobian is computed once, from the template.
  const Eigen::Matrix2d to_image = warp.inverse().transpose();
  const ProjectedJacobian jacobian(reference.window, AlignmentUnknowns::position);
  const Eigen::Matrix2d information = to_image * jacobian.information.topLeftCorner<2, 2>() * to_image.transpose();
  if (!(information.determinant() > kMinDeterminant)) return std::nullopt;
  const Eigen::Matrix2d inverse = information.inverse();

  Eigen::Vector2d position = start;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const auto difference = difference_from<2>(reference, jacobian, image, warp, position);
    if (!difference) return std::nullopt;
    const Eigen::Vector2d step = -(inverse * (to_image * difference->gradient));
    position += step;
    if (!((position - start).norm() <= radius_px)) return std::nullopt;
    if (step.norm() > kConverged_px) continue;
    const double variance = difference->variance;
    PatchAlignment found;
    found.position = position;
    found.correlation = difference->correlation;
    // `information` is a mean over the window; the sum over independent pixels is larger by their number.
    found.covariance = inverse * (variance * kHighFrequencyNoise * kNoiseCorrelation / kEffectivePixels);
    return found;
  }
  return std::nullopt;
}

std::optional<RowAlignment> align_along_row(const AlignmentTemplate& reference, ImageView<const std::uint16_t> right,
                                            const Eigen::Vector2d& centre, const RowAlignment& start,
                                            bool estimate_slant, double radius_px) {
  if (reference.deviation < kMinDeviation) return std::nullopt;
  // right(x − d − s·offset) ≈ template(x): the derivative by d is −∂x, by the slant −offset ∂x.
  const ProjectedJacobian jacobian(reference.window, AlignmentUnknowns::disparity_and_slant);
  Eigen::Matrix3d information = jacobian.information.topLeftCorner<3, 3>();
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
    const auto difference = difference_from<3>(reference, jacobian, right, warp, centre - Eigen::Vector2d(x[0], 0));
    if (!difference) return std::nullopt;
    Eigen::Vector3d gradient = difference->gradient;
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
    found.correlation = difference->correlation;
    const double variance = difference->variance;
    found.sigma_px = std::sqrt(inverse(0, 0) * variance * kNoiseCorrelation / kEffectivePixels);
    return found;
  }
  return std::nullopt;
}

std::optional<SlantedAlignment> align_slanted(const AlignmentTemplate& reference, ImageView<const std::uint16_t> right,
                                              const Eigen::Vector2d& start, double radius_px) {
  if (reference.deviation < kMinDeviation) return std::nullopt;
  // right(c + (ox − s·o, oy)) ≈ template: the derivative by c is the gradient, by the slant −offset ∂x.
  const ProjectedJacobian jacobian(reference.window, AlignmentUnknowns::position_and_slant);
  Eigen::Matrix4d information = jacobian.information;
  if (!(information.topLeftCorner<2, 2>().determinant() > kMinDeterminant)) return std::nullopt;
  const double prior = kSlantPrior * kNoiseCorrelation / kEffectivePixels;
  information(2, 2) += prior;
  information(3, 3) += prior;
  const Eigen::Matrix4d inverse = information.inverse();

  Eigen::Vector4d x(start.x(), start.y(), 0, 0);
  for (int iteration = 0; iteration < 2 * kMaxIterations; ++iteration) {
    Eigen::Matrix2d warp;
    warp << 1 - x[2], -x[3], 0, 1;
    const auto difference = difference_from<4>(reference, jacobian, right, warp, x.head<2>());
    if (!difference) return std::nullopt;
    Eigen::Vector4d gradient = difference->gradient;
    gradient.tail<2>() += prior * x.tail<2>();
    const Eigen::Vector4d step = -(inverse * gradient);
    x += step;
    if (!((x.head<2>() - start).norm() <= radius_px) || !(std::abs(x[2]) < kMaxSlantX) ||
        !(std::abs(x[3]) < kMaxSlantY)) {
      return std::nullopt;
    }
    if (step.head<2>().norm() + kSlantLever_px * step.tail<2>().norm() > 2 * kConverged_px) continue;
    const double variance = difference->variance;
    SlantedAlignment found;
    found.match.position = x.head<2>();
    found.match.correlation = difference->correlation;
    found.match.covariance = inverse.topLeftCorner<2, 2>() * (variance * kNoiseCorrelation / kEffectivePixels);
    found.slant = x.tail<2>();
    return found;
  }
  return std::nullopt;
}

}  // namespace spartan::internal
