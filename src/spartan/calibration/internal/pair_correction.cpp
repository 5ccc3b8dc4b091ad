#include "spartan/calibration/internal/pair_correction.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/calibration/internal/model_modification.h"
#include "spartan/rig/describe.h"

namespace spartan::internal {
namespace {

// A further parameter is freed where that lowers the cost by a tenth, and by at least 25 squared normalized row errors
// (empirical).
constexpr double kCheaper = 0.9, kMinGain = 25;

constexpr double kRounding = 1e-12;

// The vignetting centre in an image that is `factor` times as large and shows everything lower by `shift_px`.
void move_centre(Vignetting& vignetting, double factor, double shift_px) {
  if (!vignetting.centre_px) return;
  vignetting.centre_px = ((vignetting.centre_px->array() + 0.5) * factor - 0.5).matrix();
  vignetting.centre_px->y() += shift_px;
}

// Size of a camera's images over that of the images for which it was calibrated.
double size_ratio(ImageSize given, ImageSize assumed, const SizeChange& size, bool of_this_camera) {
  const double by_image_size = given == assumed ? 1 : size_factor(given, assumed).value_or(1);
  return of_this_camera && size.scale_centre ? by_image_size * size.factor : by_image_size;
}

}  // namespace

PairCorrection minimal_correction(const FittedHypothesis& fitted, const FoundErrors& found) {
  const PairHypothesis& h = fitted.hypothesis;
  PairFitOptions options = fit_options(h);
  options.yaw = found.yaw;
  options.focal = found.focal_ratio;
  options.baseline = found.focal_ratio;  // it was free when the focal ratio was found
  const auto fit = [&] { return fit_pair(h.left.model, h.right.model, h.left_from_right, fitted.matches, options); };
  PairFit best = fit();
  const auto free_if_needed = [&](bool& option) {
    if (option) return;
    option = true;
    PairFit freed = fit();
    option = freed.cost < kCheaper * best.cost && freed.cost < best.cost - kMinGain;
    if (option) best = std::move(freed);
  };
  if (found.distortion) free_if_needed(options.focal);
  if (found.distortion) free_if_needed(options.yaw);
  free_if_needed(options.baseline);
  return best.correction;
}

Rig corrected_rig(Rig rig, const StereoPair& pair, const PairHypothesis& hypothesis, const PairCorrection& correction,
                  bool wrong_unit) {
  const auto camera_of = [&](const std::string& name) -> Camera& {
    return *std::find_if(rig.cameras.begin(), rig.cameras.end(), [&](const Camera& c) { return c.name == name; });
  };
  StereoPair& corrected =
      *std::find_if(rig.pairs.begin(), rig.pairs.end(), [&](const auto& p) { return p.name == pair.name; });
  if (hypothesis.cameras_swapped) std::swap(corrected.left, corrected.right);
  Camera &left = camera_of(corrected.left), &right = camera_of(corrected.right);
  move_centre(left.vignetting, size_ratio(left.size, hypothesis.left.size, hypothesis.size, hypothesis.size.left), 0);
  move_centre(right.vignetting, size_ratio(right.size, hypothesis.right.size, hypothesis.size, hypothesis.size.right),
              hypothesis.row_shift_px);
  left.size = hypothesis.left.size;
  right.size = hypothesis.right.size;
  left.model = hypothesis.fit_left_radial
                   ? with_division_distortion(hypothesis.left.model, correction.left_radial, left.size)
                   : hypothesis.left.model;
  right.model = hypothesis.fit_right_radial
                    ? with_division_distortion(hypothesis.right.model, correction.right_radial, right.size)
                    : hypothesis.right.model;
  // A ratio that was not estimated is one up to rounding: keep that camera bit for bit.
  if (std::abs(correction.focal_ratio - 1) > kRounding)
    right.model = with_scaled_focal_length(right.model, correction.focal_ratio);
  Pose left_from_right = corrected_left_from_right(hypothesis.left_from_right, correction);
  if (wrong_unit) {
    const auto unit = likely_unit(left_from_right.translation().norm());
    const double metres = unit ? unit->metres : 1;
    left_from_right = Pose(left_from_right.rotation(), metres * left_from_right.translation());
  }
  right.mount_from_camera = left.mount_from_camera * left_from_right;
  return rig;
}

}  // namespace spartan::internal
