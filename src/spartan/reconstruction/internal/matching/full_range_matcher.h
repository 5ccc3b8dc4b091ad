// Semi-global matching (Hirschmüller, PAMI 2008) over eight paths, of all disparities of a range.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/internal/matching/census_pair.h"
#include "spartan/reconstruction/internal/matching/full_range_kernels.h"
#include "spartan/reconstruction/internal/matching/penalties.h"
#include "spartan/reconstruction/internal/matching/strips.h"

namespace spartan::internal::matching {

class FullRangeMatcher {
 public:
  FullRangeMatcher(const Penalties& penalties, const Kernels& kernels, const FullRangeKernels& full_range_kernels,
                   const ThreadPool& workers);

  /// Disparities in pixels, with sub-pixel part, NaN where x − d lies outside of the right image. Both images must have
  /// one size, and the range must not be empty. `strips` receives buffers for each thread. The result is valid until
  /// the next call.
  ImageView<const float> match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                               DisparityRange range, std::vector<StripBuffers>& strips);

  /// Bytes of all buffers but those of the strips.
  std::size_t buffer_bytes() const;
  /// Upper bounds of buffer_bytes() and of the bytes of the strips.
  static std::int64_t memory_bytes(ImageSize size, DisparityRange range);
  static std::int64_t strip_bytes(ImageSize size, DisparityRange range, int threads);

 private:
  class StripMatching;

  Penalties penalties_;
  Kernels kernels_;
  FullRangeKernels full_;
  ThreadPool workers_;
  CensusPair census_;
  DisparityRange range_;
  int levels_ = 0;
  Image<float> disparity_;
};

}  // namespace spartan::internal::matching
