// Census transform and semi-global matching over eight paths (Hirschmüller, PAMI 2008): the core of the dense stereo.
//
// Two passes sweep the image, one downwards with the paths from the left, upper left, above and upper right, one
// upwards with the opposite four (the same code on the image rotated by 180°). Both start at the same time, at the top
// and at the bottom. In the first half of its sweep a pass stores the sums of its four paths. In the second half it
// reads the sums that the other pass stored there, adds its own, and so completes the sums over all eight paths row by
// row, while they are still in the cache. Only one volume of sums is needed and no volume of costs. Two threads have
// equal work, and the result does not depend on their timing.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/internal/sgm_kernels.h"

namespace spartan::internal {

/// Penalties in bits of the 62-bit census cost; P2 by the gray-level change along the path.
struct SemiGlobalPenalties {
  std::uint8_t p1 = 36;
  std::array<std::uint8_t, 256> p2{};
  std::uint8_t out_of_view = 22;  ///< Matching cost where x − d lies outside of the right image.
};

class SemiGlobalMatcher {
 public:
  SemiGlobalMatcher(const SemiGlobalPenalties& penalties, sgm::Kernels kernels, ThreadPool workers);

  /// Disparities in pixels, with sub-pixel part, NaN where x − d lies outside of the right image. Both images must have
  /// one size, and the range must not be empty. The result is valid until the next call.
  ImageView<const float> match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                               DisparityRange range);

  std::size_t buffer_bytes() const;
  /// An upper bound of buffer_bytes() for images of this size and this range.
  static std::int64_t memory_bytes(ImageSize size, DisparityRange range);

 private:
  // State of one sweep.
  struct Pass {
    bool upwards = false;
    // Path costs L(p, ·), one slot a row of the image: a slot per column for each of the three directions that come
    // from the row before, and one slot for the direction along the row.
    Image<std::uint8_t> slots;
    std::vector<std::uint8_t> minima;  // min L of each slot
    Image<std::uint8_t> cost_row;      // matching costs of one row, width · padded
    Image<std::uint16_t> sum_row;      // sums over four or eight paths of one row
  };

  void resize(ImageSize size, DisparityRange range);
  void compute_census(ImageView<const std::uint8_t> image, bool mirrored, Image<std::uint8_t>& planes);
  void sweep(Pass& pass, int from_row, int to_row, bool complete);
  void compute_costs(Pass& pass, int y);
  void aggregate_row(Pass& pass, int row, int y, bool complete);
  void select_row(Pass& pass, int y);

  std::uint8_t* slot(Pass& pass, int direction, int index) const;

  SemiGlobalPenalties penalties_;
  ThreadPool workers_;
  sgm::Kernels kernels_;

  ImageSize size_;
  DisparityRange range_;
  int padded_ = 0;      // number of disparities, rounded up to whole vectors
  int mirror_pad_ = 0;  // columns before the mirrored right planes
  ImageView<const std::uint8_t> gray_;
  Image<std::uint8_t> framed_;                      // gray image with replicated border
  Image<std::uint8_t> left_planes_, right_planes_;  // 8 byte planes per image row, as consecutive rows
  Image<std::uint16_t> sums_;                       // volume of aggregated costs: row y holds width · padded sums
  std::array<Pass, 2> passes_;
  Image<std::uint8_t> zero_slot_;
  Image<float> disparity_;
};

}  // namespace spartan::internal
