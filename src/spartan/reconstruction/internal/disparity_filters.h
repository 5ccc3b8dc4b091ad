// Checks and filters that discard unreliable disparities. Unknown is NaN throughout.
#pragma once

#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/internal/semi_global_matcher.h"

namespace spartan::internal {

/// Left-right consistency check. Discards a disparity d where the right image's own match differs,
/// |d − d_right(x − d)| > tolerance_px + 0.5 (the right disparities are whole pixels), where the right pixel has no
/// match, and where the match is not unique. A negative tolerance disables the left-right part.
void drop_inconsistent(const RawDisparity& raw, double tolerance_px, const ThreadPool& workers,
                       ImageView<float> disparity);

/// Discards disparities of excluded pixels of either image (mask 0; valid is 255). An empty mask excludes nothing.
void apply_masks(ImageView<const std::uint8_t> left_mask, ImageView<const std::uint8_t> right_mask,
                 ImageView<float> disparity);

/// Median of the known values in the 3×3 neighbourhood of each known pixel; unknown pixels stay unknown.
void median_3x3(ImageView<const float> in, const ThreadPool& workers, ImageView<float> out);

/// Discards 4-connected components of fewer than `size_px` pixels. Neighbours are connected where their disparities
/// differ by at most `step_px`. Method: connected-component labelling by runs along the rows and union-find. Buffers
/// are kept from call to call.
class SpeckleFilter {
 public:
  void apply(int size_px, double step_px, ImageView<float> disparity);

 private:
  struct Run {
    int y, from, to;  ///< Pixels from … to − 1 of row y.
    int parent;       ///< Index of another run of the component; its own index at the root.
    int pixels;       ///< Pixels of the whole component, valid at its root.
  };
  int root_of(int run);
  void join(int one, int other);
  void find_runs(float step, ImageView<const float> disparity);

  std::vector<Run> runs_;
  std::vector<int> above_, here_;  ///< Run of each pixel in the row above and in this row; −1: unknown.
};

}  // namespace spartan::internal
