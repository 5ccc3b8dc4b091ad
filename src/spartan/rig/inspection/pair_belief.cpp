#include "spartan/rig/inspection/pair_belief.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/rig/inspection/row_errors.h"
#include "spartan/rig/models/model_changes.h"

namespace spartan {
namespace {

void bring_to_size(Camera& camera, ImageSize picture) {
  if (picture.empty() || camera.size == picture) return;
  if (const auto factor = size_factor(camera.size, picture)) camera.model = resized(camera.model, *factor);
  camera.size = picture;
}

}  // namespace

PairBelief belief_as_given(const Camera& left, const Camera& right, const Pose& left_from_right, ImageSize picture) {
  PairBelief belief;
  belief.left = left;
  belief.right = right;
  belief.left_from_right = left_from_right;
  bring_to_size(belief.left, picture);
  bring_to_size(belief.right, picture);
  return belief;
}

PairBelief with_eyes_in_place(PairBelief belief) {
  belief.inverted = belief.left_from_right.translation().x() < 0;
  if (belief.inverted) belief.left_from_right = belief.left_from_right.inverse();
  return belief;
}

PairBelief with_other_eyes(PairBelief belief) {
  if (belief.inverted || belief.eyes_exchanged) {
    std::swap(belief.left, belief.right);
    std::swap(belief.inverted, belief.eyes_exchanged);
  } else {
    std::swap(belief.left.model, belief.right.model);
    std::swap(belief.left.size, belief.right.size);
    belief.lenses_exchanged = !belief.lenses_exchanged;
  }
  std::swap(belief.size.left, belief.size.right);
  std::swap(belief.left_bends, belief.right_bends);
  return belief;
}

PairBelief with_other_pictures(PairBelief belief) {
  belief.pictures_exchanged = !belief.pictures_exchanged;
  return belief;
}

std::vector<PixelMatch> as_believed(const PairBelief& belief, const std::vector<PixelMatch>& matches) {
  std::vector<PixelMatch> seen = matches;
  if (belief.pictures_exchanged) {
    for (PixelMatch& match : seen) std::swap(match.left, match.right);
  }
  return seen;
}

PairBelief with_rows_as_given(PairBelief belief) {
  if (belief.rows_lower_px != 0) belief.right.model = with_rows_lower(belief.right.model, -belief.rows_lower_px);
  belief.rows_lower_px = 0;
  return belief;
}

PairBelief with_rows_moved(PairBelief belief, const std::vector<PixelMatch>& matches) {
  constexpr int kRounds = 4;  // rows of the rectified view are nearly those of the picture
  const std::vector<PixelMatch> seen = as_believed(belief, matches);
  belief = with_rows_as_given(std::move(belief));
  double lower_px = 0;
  PairBelief moved = belief;
  for (int round = 0; round < kRounds; ++round) {
    const RectifiedMatches rows = rectify_matches(moved.left.model, moved.right.model, moved.left_from_right, seen);
    const double higher_px = row_errors(rows.row_error_px).median_px;
    if (!std::isfinite(higher_px)) return belief;
    lower_px -= higher_px;
    moved.right.model = with_rows_lower(belief.right.model, lower_px);
  }
  moved.rows_lower_px = lower_px;
  return moved;
}

PairBelief with_size(PairBelief belief, const SizeChange& size, const std::vector<PixelMatch>& matches) {
  const bool moved = belief.rows_lower_px != 0;
  belief = with_rows_as_given(std::move(belief));
  belief.size = size;
  const auto change = size.centre_too ? resized : with_focal_times;
  if (size.left) belief.left.model = change(belief.left.model, size.factor);
  if (size.right) belief.right.model = change(belief.right.model, size.factor);
  return moved ? with_rows_moved(std::move(belief), matches) : belief;
}

std::vector<PairBelief> with_square_eyes(const PairBelief& belief, AspectDoubt least) {
  std::vector<PairBelief> beliefs;
  for (const bool by_x : {true, false}) {
    PairBelief square = belief;
    for (Camera* camera : {&square.left, &square.right}) {
      if (doubt_of_aspect(*camera) < least) continue;
      camera->model = with_square_pixels(camera->model, by_x);
      square.stated_size = true;
    }
    if (square.stated_size && !belief.stated_size) beliefs.push_back(std::move(square));
  }
  return beliefs;
}

}  // namespace spartan
