#include "spartan/calibration/internal/pair_hypothesis.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/calibration/internal/model_modification.h"
#include "spartan/calibration/internal/row_errors.h"

namespace spartan::internal {
namespace {

void scale_to_size(Camera& camera, ImageSize image_size) {
  if (image_size.empty() || camera.size == image_size) return;
  if (const auto factor = size_factor(camera.size, image_size)) camera.model = resized(camera.model, *factor);
  camera.size = image_size;
}

}  // namespace

PairHypothesis nominal_hypothesis(const Camera& left, const Camera& right, const Pose& left_from_right,
                                  ImageSize image_size) {
  PairHypothesis hypothesis;
  hypothesis.left = left;
  hypothesis.right = right;
  hypothesis.left_from_right = left_from_right;
  scale_to_size(hypothesis.left, image_size);
  scale_to_size(hypothesis.right, image_size);
  return hypothesis;
}

PairHypothesis with_right_camera_on_right(PairHypothesis hypothesis) {
  hypothesis.inverted = hypothesis.left_from_right.translation().x() < 0;
  if (hypothesis.inverted) hypothesis.left_from_right = hypothesis.left_from_right.inverse();
  return hypothesis;
}

PairHypothesis with_cameras_swapped(PairHypothesis hypothesis) {
  if (hypothesis.inverted || hypothesis.cameras_swapped) {
    std::swap(hypothesis.left, hypothesis.right);
    std::swap(hypothesis.inverted, hypothesis.cameras_swapped);
  } else {
    std::swap(hypothesis.left.model, hypothesis.right.model);
    std::swap(hypothesis.left.size, hypothesis.right.size);
    hypothesis.lenses_swapped = !hypothesis.lenses_swapped;
  }
  std::swap(hypothesis.size.left, hypothesis.size.right);
  std::swap(hypothesis.fit_left_radial, hypothesis.fit_right_radial);
  return hypothesis;
}

PairHypothesis with_images_swapped(PairHypothesis hypothesis) {
  hypothesis.images_swapped = !hypothesis.images_swapped;
  return hypothesis;
}

std::vector<PixelMatch> matches_under_hypothesis(const PairHypothesis& hypothesis,
                                                 const std::vector<PixelMatch>& matches) {
  std::vector<PixelMatch> oriented = matches;
  if (hypothesis.images_swapped) {
    for (PixelMatch& match : oriented) std::swap(match.left, match.right);
  }
  return oriented;
}

PairHypothesis without_row_shift(PairHypothesis hypothesis) {
  if (hypothesis.row_shift_px != 0)
    hypothesis.right.model = with_row_offset(hypothesis.right.model, -hypothesis.row_shift_px);
  hypothesis.row_shift_px = 0;
  return hypothesis;
}

PairHypothesis with_row_shift(PairHypothesis hypothesis, const std::vector<PixelMatch>& matches) {
  // Fixed-point iteration: a row of the rectified view is nearly a row of the image, so a few rounds suffice.
  constexpr int kRounds = 4;
  const std::vector<PixelMatch> oriented = matches_under_hypothesis(hypothesis, matches);
  hypothesis = without_row_shift(std::move(hypothesis));
  double shift_px = 0;
  PairHypothesis shifted = hypothesis;
  for (int round = 0; round < kRounds; ++round) {
    const RectifiedMatches rows =
        rectify_matches(shifted.left.model, shifted.right.model, shifted.left_from_right, oriented);
    const double median_px = row_errors(rows.row_error_px).median_px;
    if (!std::isfinite(median_px)) return hypothesis;
    shift_px -= median_px;
    shifted.right.model = with_row_offset(hypothesis.right.model, shift_px);
  }
  shifted.row_shift_px = shift_px;
  return shifted;
}

PairHypothesis with_size(PairHypothesis hypothesis, const SizeChange& size, const std::vector<PixelMatch>& matches) {
  const bool shifted = hypothesis.row_shift_px != 0;
  hypothesis = without_row_shift(std::move(hypothesis));
  hypothesis.size = size;
  const auto change = size.scale_centre ? resized : with_scaled_focal_length;
  if (size.left) hypothesis.left.model = change(hypothesis.left.model, size.factor);
  if (size.right) hypothesis.right.model = change(hypothesis.right.model, size.factor);
  return shifted ? with_row_shift(std::move(hypothesis), matches) : hypothesis;
}

std::vector<PairHypothesis> square_pixel_hypotheses(const PairHypothesis& hypothesis, AspectDeviation least) {
  std::vector<PairHypothesis> hypotheses;
  for (const bool by_x : {true, false}) {
    PairHypothesis square = hypothesis;
    for (Camera* camera : {&square.left, &square.right}) {
      if (aspect_deviation(*camera) < least) continue;
      camera->model = with_square_pixels(camera->model, by_x);
      square.size_from_plausibility = true;
    }
    if (square.size_from_plausibility && !hypothesis.size_from_plausibility) hypotheses.push_back(std::move(square));
  }
  return hypotheses;
}

}  // namespace spartan::internal
