#include "spartan/odometry/internal/landmark_reconstructor.h"

#include <algorithm>
#include <cmath>

#include "spartan/odometry/internal/reconstruction/row_correlation.h"

namespace spartan::internal {
namespace {

/// Standard deviation of a disparity from the dense image; empirical.
constexpr double kDenseSigma_px = 0.25;
/// Largest disparity gradient (px/px) of a dense disparity image on a surface; more is a depth edge.
constexpr double kDepthEdge = 1;
/// The sub-pixel alignment may move this far from the maximum of the row correlation.
constexpr double kAlignmentRadius_px = 1.5;
/// The row correlation may be lower than `min_correlation` by this, since its windows are not slanted; the alignment
/// then has to reach `min_correlation`. Empirical.
constexpr double kUnslantedLoss = 0.2;
/// Largest difference between the pixel and the result of the search back from right to left.
constexpr int kLeftRightTolerance_px = 1;

std::size_t index_of_best(const std::vector<float>& scores) {
  return static_cast<std::size_t>(std::max_element(scores.begin(), scores.end()) - scores.begin());
}

/// Best score outside the peak at `best`, which extends down its slopes to the next minimum on either side.
float second_best(const std::vector<float>& scores, std::size_t best) {
  std::size_t left = best, right = best;
  while (left > 0 && scores[left - 1] < scores[left]) --left;
  while (right + 1 < scores.size() && scores[right + 1] < scores[right]) ++right;
  float second = -1;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    if (i < left || i > right) second = std::max(second, scores[i]);
  }
  return second;
}

}  // namespace

std::optional<RowAlignment> LandmarkReconstructor::reconstruct(const StereoImages& images, int x, int y) const {
  if (options_.source == DisparitySource::dense && !images.disparity.empty()) return from_dense(images, x, y);
  if (images.right.empty()) return std::nullopt;
  const int min_disparity = static_cast<int>(std::floor(options_.min_disparity_px));
  const int max_disparity = static_cast<int>(std::lround(options_.max_disparity_fraction * images.left.width()));
  const std::optional<double> disparity = search(images, x, y, min_disparity, max_disparity);
  if (!disparity) return std::nullopt;
  RowAlignment start;
  start.disparity = *disparity;
  return align(images, {x, y}, start, kAlignmentRadius_px);
}

std::vector<ReconstructedFeature> LandmarkReconstructor::reconstruct(const StereoImages& images,
                                                                     const std::vector<Feature>& features,
                                                                     ThreadPool& workers) const {
  std::vector<ReconstructedFeature> result(features.size());
  workers.parallel_for(0, static_cast<int>(features.size()), 16, [&](int begin, int end) {
    for (auto i = static_cast<std::size_t>(begin); i < static_cast<std::size_t>(end); ++i) {
      const Feature& f = features[i];
      result[i] = {f, reconstruct(images, static_cast<int>(std::lround(f.x)), static_cast<int>(std::lround(f.y)))};
    }
  });
  return result;
}

std::optional<double> LandmarkReconstructor::search(const StereoImages& images, int x, int y, int min_disparity,
                                                    int max_disparity) const {
  constexpr int rx = kCorrelationRadiusX, ry = kCorrelationRadiusY;
  const int width = images.left.width(), height = images.left.height();
  if (x < rx || x + rx >= width || y < ry || y + ry >= height) return std::nullopt;
  const int from = std::max(x - max_disparity, rx), to = std::min(x - min_disparity, width - 1 - rx);
  if (to - from < 2) return std::nullopt;

  const std::vector<float> scores = correlate_row(images.left, x, y, images.right, from, to);
  const std::size_t best = index_of_best(scores);
  if (scores[best] < options_.min_correlation - kUnslantedLoss) return std::nullopt;
  if (second_best(scores, best) + options_.uniqueness > scores[best]) return std::nullopt;
  const int matched = from + static_cast<int>(best);
  if (!images.right_mask.empty() && images.right_mask(matched, y) == 0) return std::nullopt;

  if (options_.left_right_check) {
    const int back_from = std::max(matched + min_disparity, rx),
              back_to = std::min(matched + max_disparity, width - 1 - rx);
    const std::vector<float> back = correlate_row(images.right, matched, y, images.left, back_from, back_to);
    if (std::abs(back_from + static_cast<int>(index_of_best(back)) - x) > kLeftRightTolerance_px) return std::nullopt;
  }

  // Parabola through the maximum and its neighbours.
  double peak = static_cast<double>(best);
  if (best > 0 && best + 1 < scores.size()) {
    const double curvature = scores[best - 1] + scores[best + 1] - 2.0 * scores[best];
    if (curvature < 0) peak -= 0.5 * (scores[best + 1] - scores[best - 1]) / curvature;
  }
  return x - (from + peak);
}

std::optional<RowAlignment> LandmarkReconstructor::align(const StereoImages& images, const Eigen::Vector2d& pixel,
                                                         const RowAlignment& start, double radius_px) const {
  const std::optional<AlignmentTemplate> reference = AlignmentTemplate::around(images.left_smooth, pixel);
  if (!reference) return std::nullopt;
  std::optional<RowAlignment> found =
      align_along_row(*reference, images.right_smooth, pixel, start, options_.slant, radius_px);
  if (!found || found->correlation < options_.min_correlation) return std::nullopt;
  if (found->disparity < options_.min_disparity_px) return std::nullopt;
  return found;
}

std::optional<RowAlignment> LandmarkReconstructor::refine(const StereoImages& images, const Eigen::Vector2d& pixel,
                                                          const RowAlignment& predicted, double radius_px) const {
  if (options_.source == DisparitySource::dense && !images.disparity.empty()) {
    std::optional<RowAlignment> found =
        from_dense(images, static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
    if (found && std::abs(found->disparity - predicted.disparity) > radius_px) return std::nullopt;
    return found;
  }
  return align(images, pixel, predicted, radius_px);
}

std::optional<RowAlignment> LandmarkReconstructor::from_dense(const StereoImages& images, int x, int y) const {
  const ImageView<const float> dense = images.disparity;
  if (x < 1 || y < 1 || x + 1 >= dense.width() || y + 1 >= dense.height()) return std::nullopt;
  for (int j = -1; j <= 1; ++j) {
    for (int i = -1; i <= 1; ++i)
      if (!std::isfinite(dense(x + i, y + j))) return std::nullopt;
  }
  RowAlignment found;
  found.disparity = dense(x, y);
  found.slant = {0.5 * (dense(x + 1, y) - dense(x - 1, y)), 0.5 * (dense(x, y + 1) - dense(x, y - 1))};
  found.sigma_px = kDenseSigma_px;
  found.correlation = 1;
  if (found.slant.cwiseAbs().maxCoeff() > kDepthEdge) return std::nullopt;
  return found;
}

}  // namespace spartan::internal
