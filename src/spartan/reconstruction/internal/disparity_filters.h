// Checks and filters that discard unreliable disparities. Unknown is NaN throughout.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/internal/matching/refinement_kernels.h"

namespace spartan::internal {

/// Discards disparities of excluded pixels of either image (mask 0; valid is 255). An empty mask excludes nothing.
void apply_masks(ImageView<const std::uint8_t> left_mask, ImageView<const std::uint8_t> right_mask,
                 ImageView<float> disparity);

/// Median of the known values in the 3×3 neighbourhood of each known pixel; unknown pixels stay unknown.
/// `kernel` is RefinementKernels::median_row of an instruction set.
void median_3x3(ImageView<const float> in, bool (*kernel)(const matching::MedianRow&), const ThreadPool& workers,
                ImageView<float> out);

/// Gives unknown pixels the smaller one of the nearest known disparities to their left and right in the row, the
/// farther surface, as what is unknown most often is occluded. Rows without a known disparity stay unknown.
void fill_unknown(const ThreadPool& workers, ImageView<float> disparity);

/// A component of a disparity image is kept where it has enough reliable pixels.
struct SpeckleRule {
  int size_px = 0;                         ///< Smallest number of reliable pixels; 0: every component is kept.
  double step_px = 0;                      ///< Neighbours are connected where their disparities differ by at most this.
  ImageView<const std::uint8_t> reliable;  ///< 1 or 0; empty: every pixel is.
};

/// Discards the 4-connected components that are too small. Method: connected-component labelling by runs along the rows
/// and union-find, first in bands of rows, then across their borders. Buffers are kept from call to call.
class SpeckleFilter {
 public:
  void apply(const SpeckleRule& rule, const ThreadPool& workers, ImageView<float> disparity);
  std::size_t buffer_bytes() const;

 private:
  struct Run {
    int y, from, to;  ///< Pixels from … to − 1 of row y.
    int parent;       ///< Index of another run of the component; its own index at the root.
    int pixels;       ///< Reliable pixels of the whole component, valid at its root.
  };
  struct Band {
    std::vector<Run> runs;
    std::vector<int> first, above,
        here;  ///< Run of each pixel in the first row, the row above and this row; −1: unknown.
  };
  static int root_of(const std::vector<Run>& runs, int run);
  static void join(std::vector<Run>& runs, int one, int other);
  static void join_rows(std::vector<Run>& runs, const SpeckleRule& rule, ImageView<const float> disparity, int y,
                        const std::vector<int>& above, const std::vector<int>& here);
  static void find_runs(const SpeckleRule& rule, ImageView<const float> disparity, int from_row, int to_row,
                        Band& band);
  void join_bands(const SpeckleRule& rule, ImageView<const float> disparity);

  std::vector<Band> bands_;
  std::vector<Run> runs_;
};

}  // namespace spartan::internal
