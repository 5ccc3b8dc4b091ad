// Hypotheses about a stereo calibration that does not fit its images, one calibration error at a time.
#pragma once

#include <vector>

#include "spartan/calibration/internal/pair_refinement.h"
#include "spartan/rig/describe.h"
#include "spartan/rig/rig.h"

namespace spartan::internal {

/// Corrects a calibration made for another image size: scales the focal lengths, and with `scale_centre` the principal
/// point too.
struct SizeChange {
  bool left = false, right = false;  ///< cameras to which it applies
  bool scale_centre = false;
  double factor = 1;
  bool any() const { return left || right; }
};

/// A stereo calibration with assumed errors removed.
struct PairHypothesis {
  Camera left, right;
  Pose left_from_right;
  bool inverted = false;                ///< the given transform is the inverse of the correct one
  bool cameras_swapped = false;         ///< the camera that the rig calls left is the right one
  bool lenses_swapped = false;          ///< each camera has the camera model of the other one
  bool images_swapped = false;          ///< the first image was taken by the right camera
  bool size_from_plausibility = false;  ///< corrected because the calibration's own numbers are implausible
  SizeChange size;                      ///< estimated from the images
  double row_shift_px = 0;  ///< the right image shows everything this much lower than the given calibration says
  bool fit_left_radial = false, fit_right_radial = false;  ///< the pinhole lacks radial distortion: estimate it
};

/// The calibration as given. A camera whose calibration is of another image size of the same aspect ratio is scaled to
/// `image_size`. An empty size is unknown.
PairHypothesis nominal_hypothesis(const Camera& left, const Camera& right, const Pose& left_from_right,
                                  ImageSize image_size);

/// Inverts the transform where it places the right camera on the left.
PairHypothesis with_right_camera_on_right(PairHypothesis hypothesis);

/// Swaps the cameras. Where the given transform places the right camera on the left, swapped camera names are the
/// alternative to an inverse transform; where it does not, only the camera models can be swapped.
PairHypothesis with_cameras_swapped(PairHypothesis hypothesis);

PairHypothesis with_images_swapped(PairHypothesis hypothesis);

/// The matches with left and right as the hypothesis assigns the images.
std::vector<PixelMatch> matches_under_hypothesis(const PairHypothesis& hypothesis,
                                                 const std::vector<PixelMatch>& matches);

/// Assumes a crop that the calibration does not include: shifts the principal point of the right camera vertically
/// until the median row error is zero, replacing an earlier shift. A pitch cannot imitate it where the lens has
/// distortion, because distortion is centred on the principal point. `matches` as given, not swapped.
PairHypothesis with_row_shift(PairHypothesis hypothesis, const std::vector<PixelMatch>& matches);

/// Without the row shift.
PairHypothesis without_row_shift(PairHypothesis hypothesis);

/// With another size; a row shift is estimated anew. `matches` as given, not swapped.
PairHypothesis with_size(PairHypothesis hypothesis, const SizeChange& size, const std::vector<PixelMatch>& matches);

/// Hypotheses with square pixels for the cameras whose fx and fy differ at least by `least`: both set to fx, both set
/// to fy.
std::vector<PairHypothesis> square_pixel_hypotheses(const PairHypothesis& hypothesis, AspectDeviation least);

}  // namespace spartan::internal
