// Checks that take away what should not be trusted. Unknown is NaN throughout.
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/semi_global_matcher.h"

namespace spartan {

/// Drops disparities that the right eye sees elsewhere: |d − d_right(x − d)| > tolerance_px, and those that are not
/// unique.
void drop_inconsistent(const RawDisparity& raw, double tolerance_px, const Workers& workers,
                       ImageView<float> disparity);

/// Drops what lies outside the masks (255 valid); an empty mask lets all pass.
void apply_masks(ImageView<const std::uint8_t> left_mask, ImageView<const std::uint8_t> right_mask,
                 ImageView<float> disparity);

/// Median of the known values in the 3×3 neighbourhood of each known pixel; unknown pixels stay unknown.
void median_3x3(ImageView<const float> in, const Workers& workers, ImageView<float> out);

/// Drops 4-connected patches of fewer than `size_px` pixels; neighbours belong together where they differ by at most
/// `step_px`. Runs of connected pixels along the rows are joined by union and find. Keeps its buffers from call to
/// call.
class SpeckleFilter {
 public:
  void apply(int size_px, double step_px, ImageView<float> disparity);

 private:
  struct Run {
    int y, from, to;  ///< pixels from … to − 1 of row y
    int parent;       ///< index of another run of the patch; itself at the root
    int pixels;       ///< of the whole patch, at its root
  };
  int root_of(int run);
  void join(int one, int other);
  void find_runs(float step, ImageView<const float> disparity);

  std::vector<Run> runs_;
  std::vector<int> above_, here_;  ///< run of each pixel in the row above and in this one, −1: unknown
};

}  // namespace spartan
