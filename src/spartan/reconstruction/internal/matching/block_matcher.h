// Block matching: a plane sweep over all disparities of a range with Gaussian-weighted absolute differences of gray
// levels. Published stereo systems on hardware for rovers match in this way (Kostavelis et al., "SPARTAN: Developing a
// vision system for future autonomous space exploration robots", Journal of Field Robotics 2014).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/internal/matching/block_kernels.h"
#include "spartan/reconstruction/internal/matching/matches.h"

namespace spartan::internal::matching {

class BlockMatcher {
 public:
  BlockMatcher(BlockKernels kernels, const ThreadPool& workers);

  /// All images must have one size, and the range must not be empty.
  void match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right, DisparityRange range,
             const Matches& to);
  std::size_t buffer_bytes() const;
  /// An upper bound of buffer_bytes() of a new object.
  static std::int64_t memory_bytes(ImageSize size, int threads);

 private:
  // Of one strip of rows.
  struct StripBuffers {
    Image<std::uint8_t> costs, smoothed;  // of one plane, with margins
    Image<std::uint8_t> best, before, after, previous, right_best;
    Image<std::uint16_t> index, right_index;
    std::size_t bytes() const;
  };
  struct Strip {
    int from, to;
  };
  void resize(ImageSize size);
  void resize(StripBuffers& buffers) const;
  void prepare(ImageView<const std::uint8_t> from, Image<std::uint8_t>& to);
  void match_strip(const Strip& strip, StripBuffers& buffers, const Matches& to) const;
  void match_plane(const Strip& strip, int index, StripBuffers& buffers) const;
  void sum_costs(const Strip& strip, int disparity, StripBuffers& buffers) const;
  void select(const Strip& strip, const StripBuffers& buffers, const Matches& to) const;

  BlockKernels kernels_;
  ThreadPool workers_;
  ImageSize size_;
  DisparityRange range_;
  Image<std::uint8_t> left_, right_;  // without their local mean, with replicated columns on both sides
  std::array<Image<std::uint8_t>, 2> means_;
  std::vector<StripBuffers> strips_;
};

}  // namespace spartan::internal::matching
