#include "spartan/reconstruction/internal/matching/census_pair.h"

#include <algorithm>
#include <cstring>

#include "spartan/reconstruction/internal/matching/image_bytes.h"
#include "spartan/reconstruction/internal/matching/row_padding.h"

namespace spartan::internal::matching {
namespace {

constexpr int kWindowColumns = 4, kWindowRows = 3;  // half sizes of the census window
constexpr int kRowsAtATime = 32;

// A row with its first and last pixel repeated.
void copy_row(const std::uint8_t* from, int width, int before, int after, std::uint8_t* to) {
  std::memset(to, from[0], static_cast<std::size_t>(before));
  std::memcpy(to + before, from, static_cast<std::size_t>(width));
  std::memset(to + before + width, from[width - 1], static_cast<std::size_t>(after));
}

}  // namespace

CensusPair::CensusPair(void (*census_row)(const CensusRow&), const ThreadPool& workers)
    : census_row_(census_row), workers_(workers) {}

void CensusPair::resize(ImageSize size, DisparityRange reach) {
  const int pad = std::max(0, -reach.min) + kRowPadding;
  const int right_width = pad + size.width + std::max(0, reach.max) + 2 * kRowPadding;
  if (size == size_ && mirror_pad_ == pad && right_planes_.width() >= right_width) return;
  size_ = {};  // stays so if an allocation fails
  gray_ = Image<std::uint8_t>(size.width + 3 * kRowPadding, size.height);
  framed_ = Image<std::uint8_t>(size.width + 2 * kWindowColumns + kRowPadding, size.height + 2 * kWindowRows);
  left_planes_ = Image<std::uint8_t>(size.width + kRowPadding, size.height * kPlanes);
  right_planes_ = Image<std::uint8_t>(right_width, size.height * kPlanes);
  mirror_pad_ = pad;
  size_ = size;
}

void CensusPair::compute(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                         DisparityRange reach) {
  resize(left.size(), reach);
  for (int y = 0; y < size_.height; ++y) copy_row(left.row(y), size_.width, kRowPadding, 2 * kRowPadding, gray_.row(y));
  compute_planes(left, false, left_planes_);
  compute_planes(right, true, right_planes_);
}

const std::uint8_t* CensusPair::gray(int y) const {
  return gray_.row(y) + kRowPadding;
}

void CensusPair::compute_planes(ImageView<const std::uint8_t> image, bool mirrored, Image<std::uint8_t>& planes) {
  const int w = size_.width, h = size_.height;
  workers_.parallel_for(0, framed_.height(), kRowsAtATime, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      copy_row(image.row(std::clamp(y - kWindowRows, 0, h - 1)), w, kWindowColumns,
               framed_.width() - kWindowColumns - w, framed_.row(y));
    }
  });
  workers_.parallel_for(0, h, kRowsAtATime, [&](int from, int to) {
    Image<std::uint8_t> forward(mirrored ? w + kRowPadding : 0, mirrored ? kPlanes : 0);
    for (int y = from; y < to; ++y) {
      CensusRow row{};
      row.width = w;
      for (int r = 0; r < 7; ++r) row.rows[r] = framed_.row(y + r) + kWindowColumns;
      for (int p = 0; p < kPlanes; ++p) row.planes[p] = mirrored ? forward.row(p) : planes.row(y * kPlanes + p);
      census_row_(row);
      if (!mirrored) continue;
      for (int p = 0; p < kPlanes; ++p)
        std::reverse_copy(forward.row(p), forward.row(p) + w, planes.row(y * kPlanes + p) + mirror_pad_);
    }
  });
}

std::size_t CensusPair::buffer_bytes() const {
  std::size_t total = 0;
  for (const Image<std::uint8_t>* image : {&gray_, &framed_, &left_planes_, &right_planes_}) total += bytes_of(*image);
  return total;
}

std::int64_t CensusPair::memory_bytes(ImageSize size, DisparityRange reach) {
  const std::int64_t row = size.width + 5 * kRowPadding, shift = std::max(0, -reach.min) + std::max(0, reach.max);
  return (kPlanes * (2 * row + shift) + 2 * row) * (size.height + 2 * kWindowRows);
}

}  // namespace spartan::internal::matching
