#include "spartan/reconstruction/internal/semi_global_matcher.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "spartan/reconstruction/internal/subpixel.h"

namespace spartan::internal {
namespace {

constexpr int kWindowColumns = 4, kWindowRows = 3;  // half sizes of the 9×7 census window
constexpr int kVector = 64;                         // bytes of the widest vector: padding behind each row

int round_up(int value, int multiple) {
  return (value + multiple - 1) / multiple * multiple;
}

}  // namespace

SemiGlobalMatcher::SemiGlobalMatcher(const SemiGlobalPenalties& penalties, sgm::Kernels kernels, ThreadPool workers)
    : penalties_(penalties), workers_(std::move(workers)), kernels_(kernels) {
  passes_[1].upwards = true;
}

void SemiGlobalMatcher::resize(ImageSize size, DisparityRange range) {
  if (size == size_ && range.min == range_.min && range.max == range_.max) return;
  size_ = {};  // stays so if an allocation fails
  range_ = range;
  padded_ = round_up(range.count(), 32);
  mirror_pad_ = std::max(0, -range.min);
  const int w = size.width, h = size.height;
  framed_ = Image<std::uint8_t>(w + 2 * kWindowColumns + kVector, h + 2 * kWindowRows);
  left_planes_ = Image<std::uint8_t>(w + kVector, h * sgm::kPlanes);
  right_planes_ = Image<std::uint8_t>(mirror_pad_ + w + std::max(0, range.min) + padded_ + kVector, h * sgm::kPlanes);
  sums_ = Image<std::uint16_t>(w * padded_, h);
  const int slot_count = 3 * w + 1, slot_size = padded_ + 2 * sgm::kGuard;
  for (Pass& pass : passes_) {
    pass.slots = Image<std::uint8_t>(slot_size, slot_count, sgm::kNever);
    pass.minima.assign(static_cast<std::size_t>(slot_count), 0);
    pass.cost_row = Image<std::uint8_t>(w * padded_, 1);
    pass.sum_row = Image<std::uint16_t>(w * padded_, 1);
  }
  zero_slot_ = Image<std::uint8_t>(slot_size, 1);
  disparity_ = Image<float>(w, h);
  size_ = size;
}

std::int64_t SemiGlobalMatcher::memory_bytes(ImageSize size, DisparityRange range) {
  const std::int64_t w = size.width, h = size.height, padded = round_up(range.count(), 32);
  const std::int64_t shift = std::max(0, -range.min) + std::max(0, range.min) + padded;
  const std::int64_t volume = 2 * w * h * padded;
  const std::int64_t rows = 16 * w * (padded + 2 * sgm::kGuard);  // of both passes
  const std::int64_t planes = sgm::kPlanes * h * (2 * w + shift + 4 * kVector);
  return volume + rows + planes + 9 * w * h;
}

std::size_t SemiGlobalMatcher::buffer_bytes() const {
  const auto bytes = [](const auto& image, std::size_t pixel) {
    return static_cast<std::size_t>(image.stride()) * static_cast<std::size_t>(image.height()) * pixel;
  };
  std::size_t total =
      bytes(framed_, 1) + bytes(left_planes_, 1) + bytes(right_planes_, 1) + bytes(sums_, 2) + bytes(zero_slot_, 1);
  for (const Pass& pass : passes_) {
    total += bytes(pass.slots, 1) + pass.minima.size() + bytes(pass.cost_row, 1) + bytes(pass.sum_row, 2);
  }
  return total + bytes(disparity_, 4);
}

ImageView<const float> SemiGlobalMatcher::match(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                                DisparityRange range) {
  resize(left.size(), range);
  gray_ = left;
  compute_census(left, false, left_planes_);
  compute_census(right, true, right_planes_);
  // Both passes sweep their first halves, then, after a barrier, complete the sums in the half of the other pass.
  const int h = size_.height, upper = h / 2, lower = h - upper;
  workers_.parallel_invoke([&] { sweep(passes_[0], 0, upper, false); }, [&] { sweep(passes_[1], 0, lower, false); });
  workers_.parallel_invoke([&] { sweep(passes_[0], upper, h, true); }, [&] { sweep(passes_[1], lower, h, true); });
  return disparity_;
}

void SemiGlobalMatcher::compute_census(ImageView<const std::uint8_t> image, bool mirrored,
                                       Image<std::uint8_t>& planes) {
  const int w = size_.width, h = size_.height;
  for (int y = 0; y < framed_.height(); ++y) {
    const std::uint8_t* const source = image.row(std::clamp(y - kWindowRows, 0, h - 1));
    std::uint8_t* const target = framed_.row(y);
    std::memset(target, source[0], kWindowColumns);
    std::memcpy(target + kWindowColumns, source, static_cast<std::size_t>(w));
    std::memset(target + kWindowColumns + w, source[w - 1],
                static_cast<std::size_t>(framed_.width() - kWindowColumns - w));
  }
  workers_.parallel_for(0, h, 32, [&](int from, int to) {
    Image<std::uint8_t> forward(mirrored ? w + kVector : 0, mirrored ? sgm::kPlanes : 0);
    for (int y = from; y < to; ++y) {
      sgm::CensusRow row{};
      row.width = w;
      for (int r = 0; r < 7; ++r) row.rows[r] = framed_.row(y + r) + kWindowColumns;
      for (int p = 0; p < sgm::kPlanes; ++p)
        row.planes[p] = mirrored ? forward.row(p) : planes.row(y * sgm::kPlanes + p);
      kernels_.census_row(row);
      if (!mirrored) continue;
      for (int p = 0; p < sgm::kPlanes; ++p) {
        std::reverse_copy(forward.row(p), forward.row(p) + w, planes.row(y * sgm::kPlanes + p) + mirror_pad_);
      }
    }
  });
}

void SemiGlobalMatcher::sweep(Pass& pass, int from_row, int to_row, bool complete) {
  for (int row = from_row; row < to_row; ++row) {
    const int y = pass.upwards ? size_.height - 1 - row : row;
    compute_costs(pass, y);
    aggregate_row(pass, row, y, complete);
    if (complete) select_row(pass, y);
  }
}

void SemiGlobalMatcher::compute_costs(Pass& pass, int y) {
  const int w = size_.width, count = range_.count();
  sgm::CostRow row{};
  row.width = w;
  row.padded = padded_;
  row.cost = pass.cost_row.data();
  for (int p = 0; p < sgm::kPlanes; ++p) {
    row.left[p] = left_planes_.row(y * sgm::kPlanes + p);
    row.right[p] = right_planes_.row(y * sgm::kPlanes + p) + mirror_pad_ + w - 1 + range_.min;
  }
  kernels_.cost_row(row);
  for (int x = 0; x < w; ++x) {
    std::uint8_t* const cost = row.cost + static_cast<std::ptrdiff_t>(x) * padded_;
    // Index k is matched to the right column x − min − k: outside of the image for k > x − min and k < x − min − w + 1.
    const int last = std::clamp(x - range_.min + 1, 0, count), first = std::clamp(x - range_.min - w + 1, 0, count);
    std::memset(cost, penalties_.out_of_view, static_cast<std::size_t>(first));
    std::memset(cost + last, penalties_.out_of_view, static_cast<std::size_t>(count - last));
    std::memset(cost + count, sgm::kNever, static_cast<std::size_t>(padded_ - count));
  }
}

std::uint8_t* SemiGlobalMatcher::slot(Pass& pass, int direction, int index) const {
  return pass.slots.row(direction * size_.width + index) + sgm::kGuard;
}

// `row` counts along the sweep; column x of the sweep is column w − 1 − x of the image in the upward pass. A diagonal
// path keeps its slot from row to row, because (x − row) or (x + row) is constant along it.
void SemiGlobalMatcher::aggregate_row(Pass& pass, int row, int y, bool complete) {
  const int w = size_.width;
  const int flip = pass.upwards ? -1 : 1, first = pass.upwards ? w - 1 : 0;
  const std::uint8_t* const gray = gray_.row(y);
  const std::uint8_t* const before = row > 0 ? gray_.row(pass.upwards ? y + 1 : y - 1) : gray;
  const std::uint8_t* const zero = zero_slot_.data() + sgm::kGuard;
  const auto w_index = [w](int value) { return ((value % w) + w) % w; };
  int diagonal_right = w_index(-row), diagonal_left = w_index(row);

  for (int x = 0; x < w; ++x) {
    const int column = first + flip * x;
    const std::array<int, sgm::kPaths> indices{diagonal_right, x, diagonal_left, 0};
    const std::array<bool, sgm::kPaths> begins{row == 0 || x == 0, row == 0, row == 0 || x == w - 1, x == 0};
    const std::array<std::uint8_t, sgm::kPaths> previous{
        begins[0] ? gray[column] : before[column - flip], before[column],
        begins[2] ? gray[column] : before[column + flip], begins[3] ? gray[column] : gray[column - flip]};
    sgm::PixelPaths paths{};
    for (int r = 0; r < sgm::kPaths; ++r) {
      const auto i = static_cast<std::size_t>(r);
      paths.to[r] = slot(pass, r, indices[i]);
      // At the start of a path L' = 0, so that L = C.
      paths.from[r] = begins[i] ? zero : paths.to[r];
      paths.from_min[r] = begins[i] ? std::uint8_t{0} : pass.minima[static_cast<std::size_t>(r * w + indices[i])];
      paths.p2[r] = penalties_.p2[static_cast<std::size_t>(std::abs(gray[column] - previous[i]))];
    }
    paths.p1 = penalties_.p1;
    paths.padded = padded_;
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(column) * padded_;
    paths.cost = pass.cost_row.data() + at;
    paths.add = complete ? sums_.row(y) + at : nullptr;
    paths.sum = complete ? pass.sum_row.data() + at : sums_.row(y) + at;
    const sgm::PathMinima minima = kernels_.pixel_paths(paths);
    for (int r = 0; r < sgm::kPaths; ++r) {
      pass.minima[static_cast<std::size_t>(r * w + indices[static_cast<std::size_t>(r)])] = minima.of[r];
    }
    diagonal_right = diagonal_right + 1 == w ? 0 : diagonal_right + 1;
    diagonal_left = diagonal_left + 1 == w ? 0 : diagonal_left + 1;
  }
}

void SemiGlobalMatcher::select_row(Pass& pass, int y) {
  const int w = size_.width, count = range_.count();
  float* const disparity = disparity_.row(y);
  for (int x = 0; x < w; ++x) {
    const std::uint16_t* const sums = pass.sum_row.data() + static_cast<std::ptrdiff_t>(x) * padded_;
    const int index = kernels_.find_winner(sums, padded_);
    const int d = range_.min + index, matched = x - d;
    disparity[x] = matched < 0 || matched >= w ? std::numeric_limits<float>::quiet_NaN()
                                               : static_cast<float>(d) + subpixel_offset(sums, index, count);
  }
}

}  // namespace spartan::internal
