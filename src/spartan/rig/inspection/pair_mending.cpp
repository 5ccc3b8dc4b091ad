#include "spartan/rig/inspection/pair_mending.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/rig/models/model_changes.h"
#include "spartan/rig/rig_findings.h"

namespace spartan {
namespace {

// Freed where the rows cost so much less with it.
constexpr double kCheaper = 0.9, kLeastGain = 25;

constexpr double kRounding = 1e-12;

// What the vignetting is measured from, in pictures that are `factor` times as large and then show everything lower.
void move_centre(Vignetting& vignetting, double factor, double lower_px) {
  if (!vignetting.centre_px) return;
  vignetting.centre_px = ((vignetting.centre_px->array() + 0.5) * factor - 0.5).matrix();
  vignetting.centre_px->y() += lower_px;
}

// How much larger the pictures of an eye are than those that the calibration counts its pixels in.
double enlargement(ImageSize given, ImageSize believed, const SizeChange& size, bool of_this_eye) {
  const double stated = given == believed ? 1 : size_factor(given, believed).value_or(1);
  return of_this_eye && size.centre_too ? stated * size.factor : stated;
}

}  // namespace

PairCorrection needed_correction(const BelievedPair& believed, const FoundWrong& found) {
  const PairBelief& b = believed.belief;
  PairFitOptions options = fit_options(b);
  options.yaw = found.yaw;
  options.focal = found.focal_ratio;
  options.baseline = found.focal_ratio;  // as it was when that was found
  const auto fit = [&] { return fit_pair(b.left.model, b.right.model, b.left_from_right, believed.matches, options); };
  PairFit best = fit();
  const auto free_if_needed = [&](bool& option) {
    if (option) return;
    option = true;
    PairFit freed = fit();
    option = freed.cost < kCheaper * best.cost && freed.cost < best.cost - kLeastGain;
    if (option) best = std::move(freed);
  };
  if (found.distortion) free_if_needed(options.focal);
  if (found.distortion) free_if_needed(options.yaw);
  free_if_needed(options.baseline);
  return best.correction;
}

Rig mended_rig(Rig rig, const StereoPair& pair, const PairBelief& belief, const PairCorrection& correction,
               bool wrong_unit) {
  const auto camera_of = [&](const std::string& name) -> Camera& {
    return *std::find_if(rig.cameras.begin(), rig.cameras.end(), [&](const Camera& c) { return c.name == name; });
  };
  StereoPair& mended =
      *std::find_if(rig.pairs.begin(), rig.pairs.end(), [&](const auto& p) { return p.name == pair.name; });
  if (belief.eyes_exchanged) std::swap(mended.left, mended.right);
  Camera &left = camera_of(mended.left), &right = camera_of(mended.right);
  move_centre(left.vignetting, enlargement(left.size, belief.left.size, belief.size, belief.size.left), 0);
  move_centre(right.vignetting, enlargement(right.size, belief.right.size, belief.size, belief.size.right),
              belief.rows_lower_px);
  left.size = belief.left.size;
  right.size = belief.right.size;
  left.model =
      belief.left_bends ? with_radial(belief.left.model, correction.left_radial, left.size) : belief.left.model;
  right.model =
      belief.right_bends ? with_radial(belief.right.model, correction.right_radial, right.size) : belief.right.model;
  // A ratio that was not asked for is one but for rounding: such a camera stays bit for bit as it was.
  if (std::abs(correction.focal_ratio - 1) > kRounding)
    right.model = with_focal_times(right.model, correction.focal_ratio);
  Pose left_from_right = corrected_left_from_right(belief.left_from_right, correction);
  if (wrong_unit) {
    const auto unit = likelier_unit(left_from_right.translation().norm());
    const double metres = unit ? unit->metres : 1;
    left_from_right = Pose(left_from_right.rotation(), metres * left_from_right.translation());
  }
  right.mount_from_camera = left.mount_from_camera * left_from_right;
  return rig;
}

}  // namespace spartan
