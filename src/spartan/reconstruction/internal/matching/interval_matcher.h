// Semi-global matching (Hirschmüller, PAMI 2008) over eight paths, in two search intervals per tile of the image.
//
// The image is cut into strips of rows, which are independent: their number depends on the height alone, so the result
// is the same for any number of threads. A strip begins its downward paths kStripMargin rows above itself and its
// upward paths as many rows below, where their start has little influence left. No volume of the whole image exists.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/internal/matching/interval_kernels.h"
#include "spartan/reconstruction/internal/matching/row_padding.h"
#include "spartan/reconstruction/internal/matching/search_intervals.h"

namespace spartan::internal::matching {

inline constexpr int kStripMargin = 32;

/// Penalties in bits of the 32-bit census cost.
struct Penalties {
  std::uint8_t p1 = 18;
  alignas(16) std::array<std::uint8_t, 16> p2{};  ///< By the gray-level change, see P2Row.
  std::uint8_t out_of_view = 11;                  ///< Cost where x − d lies outside of the right image.
};

/// Matches before any check except the one against the image border.
struct IntervalMatches {
  Image<float> disparity;              ///< px, with sub-pixel part; NaN where x − d lies outside of the right image.
  Image<std::uint8_t> right_distance;  ///< px, 0 … 16: from x to the left pixel that the matched right pixel prefers.
};

/// Buffers of one strip, kept from call to call; they only grow. Matchers that run one after the other share them.
struct StripBuffers {
  Image<std::uint8_t> costs;  // of one row, as are the sums
  Image<std::uint16_t> sums;
  std::vector<std::uint8_t> paths, p2;
  std::vector<std::uint16_t> unused_sums, winners, right_best;
  std::vector<std::int16_t> starts;
  std::vector<ColumnRun> runs;
  std::size_t bytes() const;
};

class IntervalMatcher {
 public:
  IntervalMatcher(const Penalties& penalties, Kernels kernels, ThreadPool workers);

  /// Both images must have one size, `tiles` one element for each tile of it. `strips` receives buffers for each
  /// thread. The result is valid until the next call.
  const IntervalMatches& match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                               ImageView<const TileIntervals> tiles, DisparityRange range,
                               std::vector<StripBuffers>& strips);
  /// Bytes of all buffers but those of the strips.
  std::size_t buffer_bytes() const;
  /// Upper bounds of buffer_bytes() and of the bytes of the strips.
  static std::int64_t memory_bytes(ImageSize size, DisparityRange range);
  static std::int64_t strip_bytes(ImageSize size, DisparityRange range, int threads);

 private:
  class StripMatching;

  void resize(ImageSize size, DisparityRange range);
  void compute_census(ImageView<const std::uint8_t> image, bool mirrored, Image<std::uint8_t>& planes);

  Penalties penalties_;
  Kernels kernels_;
  ThreadPool workers_;
  ImageSize size_;
  DisparityRange range_;
  int mirror_pad_ = 0;                              // columns before the mirrored right planes
  Image<std::uint8_t> left_gray_, framed_;          // with replicated border
  Image<std::uint8_t> left_planes_, right_planes_;  // kPlanes rows per image row
  IntervalMatches matches_;
};

}  // namespace spartan::internal::matching
