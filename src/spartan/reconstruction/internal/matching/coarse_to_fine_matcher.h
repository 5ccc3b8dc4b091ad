// Coarse-to-fine semi-global matching: all disparities of the range are searched at a quarter of the resolution, then
// two intervals of 16 disparities around the matches found, at half and at full resolution. The time of the fine levels
// does not depend on the search range.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/internal/matching/full_range_matcher.h"
#include "spartan/reconstruction/internal/matching/interval_matcher.h"

namespace spartan::internal::matching {

class CoarseToFineMatcher {
 public:
  CoarseToFineMatcher(const DisparityOptions& options, const ThreadPool& workers);

  /// All images must have one size, and the range must not be empty.
  void match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right, DisparityRange range,
             const Matches& to);
  double coarse_ms() const { return coarse_ms_; }  ///< Of the last call: time before the full resolution.
  std::size_t buffer_bytes() const;
  /// An upper bound of buffer_bytes().
  static std::int64_t memory_bytes(ImageSize size, DisparityRange range, int threads);

 private:
  CoarseToFineMatcher(const Penalties& penalties, std::size_t simd, const ThreadPool& workers);
  struct Halved {
    Image<std::uint8_t> left, right;
  };

  ThreadPool workers_;
  Halved half_, quarter_;
  FullRangeMatcher base_;
  IntervalMatcher half_matcher_, full_matcher_;
  Image<float> half_disparity_;
  std::vector<StripBuffers> strips_;  // of all levels
  double coarse_ms_ = 0;
};

}  // namespace spartan::internal::matching
