// Census signatures and gray levels of a rectified pair, laid out for the matching kernels.
#pragma once

#include <cstddef>
#include <cstdint>

#include "spartan/core/image.h"
#include "spartan/core/threads.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/reconstruction/internal/matching/interval_kernels.h"

namespace spartan::internal::matching {

class CensusPair {
 public:
  CensusPair(void (*census_row)(const CensusRow&), const ThreadPool& workers);

  /// Both images must have one size. `reach`: the disparities that kernels may read.
  void compute(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right, DisparityRange reach);

  ImageSize size() const { return size_; }
  /// Gray levels of a row of the left image, readable for a vector on both sides.
  const std::uint8_t* gray(int y) const;
  const std::uint8_t* left_plane(int plane, int y) const { return left_planes_.row(y * kPlanes + plane); }
  /// The mirrored pixel of x = 0 and disparity 0: pixel x and disparity d are at [d − x].
  const std::uint8_t* right_plane(int plane, int y) const {
    return right_planes_.row(y * kPlanes + plane) + mirror_pad_ + size_.width - 1;
  }
  std::size_t buffer_bytes() const;
  /// An upper bound of buffer_bytes().
  static std::int64_t memory_bytes(ImageSize size, DisparityRange reach);

 private:
  void resize(ImageSize size, DisparityRange reach);
  void compute_planes(ImageView<const std::uint8_t> image, bool mirrored, Image<std::uint8_t>& planes);

  void (*census_row_)(const CensusRow&);
  ThreadPool workers_;
  ImageSize size_;
  int mirror_pad_ = 0;                              // columns before the mirrored right planes
  Image<std::uint8_t> gray_, framed_;               // with replicated border
  Image<std::uint8_t> left_planes_, right_planes_;  // kPlanes rows per image row
};

}  // namespace spartan::internal::matching
