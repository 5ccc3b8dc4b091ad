// Semi-global matching (Hirschmüller, PAMI 2008) over eight paths, in two search intervals per tile of the image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/internal/matching/census_pair.h"
#include "spartan/reconstruction/internal/matching/interval_kernels.h"
#include "spartan/reconstruction/internal/matching/matches.h"
#include "spartan/reconstruction/internal/matching/penalties.h"
#include "spartan/reconstruction/internal/matching/search_intervals.h"
#include "spartan/reconstruction/internal/matching/strips.h"

namespace spartan::internal::matching {

class IntervalMatcher {
 public:
  IntervalMatcher(const Penalties& penalties, const Kernels& kernels, const ThreadPool& workers);

  /// Both images must have one size, `tiles` one element for each tile of it. `strips` receives buffers for each
  /// thread. Without right distances (an empty image) the disparities are whole pixels.
  void match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
             ImageView<const TileIntervals> tiles, DisparityRange range, std::vector<StripBuffers>& strips,
             const Matches& to);
  /// Bytes of all buffers but those of the strips.
  std::size_t buffer_bytes() const;
  /// Upper bounds of buffer_bytes() and of the bytes of the strips.
  static std::int64_t memory_bytes(ImageSize size, DisparityRange range);
  static std::int64_t strip_bytes(ImageSize size, DisparityRange range, int threads);

 private:
  class StripMatching;

  Penalties penalties_;
  Kernels kernels_;
  ThreadPool workers_;
  CensusPair census_;
  DisparityRange range_;
};

}  // namespace spartan::internal::matching
