// Census + semi-global matching over eight paths: the matching core of the disparity computation.
//
// Two passes sweep the image, one downwards with the paths from the left, upper left, above and upper right, one
// upwards with the opposite four (the same code on the picture turned by 180°). Both start at once, at the top and at
// the bottom. In the first half of its sweep a pass stores the sum of its four paths; in the second half it finds the
// other's sums there, adds its own, and has the sums over all eight paths, row by row, while they are still in the
// cache. So there is one volume of sums and none of costs, and two threads have equal work whose result cannot depend
// on who is faster.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/disparity_options.h"
#include "spartan/reconstruction/sgm_kernels.h"

namespace spartan {

/// Raw matches, before any check but the one against the picture's border.
struct RawDisparity {
  Image<float> left;           ///< px, with sub-pixel part; NaN where the match leaves the right image
  Image<std::uint8_t> unique;  ///< 1 where no runner-up comes near
  Image<std::int16_t> right;   ///< px, whole: of the cheapest left pixel that claims it; kNoMatch: none does
  static constexpr std::int16_t kNoMatch = INT16_MIN;
};

class SemiGlobalMatcher {
 public:
  SemiGlobalMatcher(const DisparityOptions& options, Workers workers);

  /// Both images of one size; the range is not empty. The result stays valid until the next call.
  const RawDisparity& match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                            DisparityRange range);

  /// Of the last call, in milliseconds; steps that run on two threads count their mean.
  const DisparityTimes& times() const { return times_; }
  std::size_t buffer_bytes() const;

 private:
  // What one sweep carries along.
  struct Pass {
    bool upwards = false;
    Image<std::uint8_t> slots;  // path costs, a slot a row: one a pixel for each of three directions, one for the row
    std::vector<std::uint8_t> minima;       // of each slot
    Image<std::uint8_t> cost_row;           // padded · width
    Image<std::uint16_t> sum_row;           // of four or eight paths
    std::vector<std::uint16_t> claim_cost;  // of the cheapest left pixel that claims each right pixel of the row
    double cost_ms = 0, aggregate_ms = 0, select_ms = 0;
  };

  void resize(ImageSize size, DisparityRange range);
  void compute_census(ImageView<const std::uint8_t> image, bool mirrored, Image<std::uint8_t>& planes);
  void sweep(Pass& pass, int from_row, int to_row, bool complete);
  void compute_costs(Pass& pass, int y);
  void aggregate_row(Pass& pass, int row, int y, bool complete);
  void select_row(Pass& pass, int y);

  std::uint8_t* slot(Pass& pass, int direction, int index) const;

  DisparityOptions options_;
  Workers workers_;
  sgm::Kernels kernels_;
  std::array<std::uint8_t, 256> p2_by_step_{};

  ImageSize size_;
  DisparityRange range_;
  int padded_ = 0;      // disparities, filled up to whole vectors
  int mirror_pad_ = 0;  // columns before the mirrored right planes
  ImageView<const std::uint8_t> gray_;
  Image<std::uint8_t> framed_;                      // gray image with its border repeated
  Image<std::uint8_t> left_planes_, right_planes_;  // 8 rows a row
  Image<std::uint16_t> sums_;                       // volume: row y holds width · padded sums
  std::array<Pass, 2> passes_;
  Image<std::uint8_t> zero_slot_;
  RawDisparity raw_;
  DisparityTimes times_;
};

}  // namespace spartan
