#include "spartan/reconstruction/internal/matching/subpixel_refinement.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "spartan/reconstruction/internal/matching/image_bytes.h"

namespace spartan::internal::matching {
namespace {

constexpr int kGrayPad = kRowPadding;  // columns before the first pixel of the gray images
constexpr int kFitBand = 64;           // rows of one part of the fit
constexpr int kWindow = 2 * kFitRadius + 1;
constexpr std::size_t kFitRows = 5;  // of one row of the image: see WarpRow
constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();

// Noise of gray levels that the fit assumes at least, and standard deviation of disparities before the fit.
constexpr float kNoise_levels = 1.5F, kPrior_px = 0.7F;
// Of a window that has texture: information of its own, px⁻², and correlation of the gradients of both images.
constexpr float kLeastTexture = 1, kLeastCorrelation = 0.3F;
// Distances of the pairs of each smoothing, and the bounds of SmoothRow. Long steps reach far at few operations (à
// trous; Dammertz et al., High Performance Graphics 2010). After the fit they begin at half of its window, because
// fits of nearer neighbours share most of their pixels; the last one averages what the long steps have left between
// them.
constexpr std::array<int, 2> kStepsBeforeFit{1, 2};
constexpr std::array<int, 3> kStepsAfterFit{4, 8, 2};
constexpr float kToleranceBefore_px = 1.5F, kToleranceAfter_px = 0.7F, kLeastTolerance_px = 0.1F,
                kToleranceSigmas = 2.5F;
// Pairs raise the information by this share of their own: fits of neighbours share most of their pixels.
constexpr float kGrowth = 0.3F;

}  // namespace

SubpixelRefinement::SubpixelRefinement(RefinementKernels kernels, const ThreadPool& workers)
    : kernels_(kernels), workers_(workers) {}

void SubpixelRefinement::resize(ImageSize size) {
  if (size == size_) return;
  size_ = {};  // stays so if an allocation fails
  const int w = size.width, h = size.height, wide = w + 2 * kPad + kRowPadding / 4;
  left_ = Image<std::uint8_t>(w + 2 * kGrayPad, h);
  right_ = Image<std::uint8_t>(w + 2 * kGrayPad, h);
  for (Image<float>& image : disparity_) image = Image<float>(wide, h, kUnknown);
  for (Image<float>& image : information_) image = Image<float>(wide, h);
  textured_ = Image<std::uint8_t>(w + kRowPadding, h);
  const auto samples = [](int pixels) { return (pixels + kGradientStep - 1) / kGradientStep; };
  mean_gradient_ = Image<float>(samples(w), samples(h));
  gradient_difference_ = Image<float>(samples(w), samples(h));
  no_disparity_ = Image<float>(wide, 1, kUnknown);
  no_information_ = Image<float>(wide, 1);
  size_ = size;
}

void SubpixelRefinement::smooth(const Smoothing& by) {
  workers_.parallel_for(0, size_.height, 32, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      SmoothRow row{};
      for (int i = 0; i < 3; ++i) {
        const int source = y + (i - 1) * by.step;
        const bool inside = source >= 0 && source < size_.height;
        row.disparity[i] = (inside ? disparity_[0].row(source) : no_disparity_.row(0)) + kPad;
        row.information[i] = (inside ? information_[0].row(source) : no_information_.row(0)) + kPad;
      }
      row.smoothed = disparity_[1].row(y) + kPad;
      row.smoothed_information = information_[1].row(y) + kPad;
      row.width = size_.width;
      row.step = by.step;
      row.tolerance = by.tolerance;
      row.least_tolerance = by.least_tolerance;
      row.sigmas = by.sigmas;
      row.growth = by.growth;
      kernels_.smooth_row(row);
      // The last vector has written behind the last column.
      std::fill_n(row.smoothed + size_.width, kPad, kUnknown);
    }
  });
  std::swap(disparity_[0], disparity_[1]);
  std::swap(information_[0], information_[1]);
}

void SubpixelRefinement::measure_relief() {
  workers_.parallel_for(0, size_.height, 32, [&](int from, int to) {
    for (int y = from; y < to; ++y) {
      const auto row = [&](int at) {
        return (at >= 0 && at < size_.height ? disparity_[0].row(at) : no_disparity_.row(0)) + kPad;
      };
      constexpr auto& step = ReliefRow::kSteps;
      kernels_.relief_row({{row(y - step[0]), row(y - step[1])},
                           {row(y + step[0]), row(y + step[1])},
                           row(y),
                           information_[1].row(y) + kPad,
                           size_.width});
    }
  });
}

void SubpixelRefinement::sample_gradients(int row, const std::array<const std::int32_t*, kFitSums>& columns,
                                          std::vector<float>& buffer) {
  const auto stride = static_cast<std::size_t>(size_.width + kRowPadding);
  buffer.resize(std::max(buffer.size(), 2 * stride));
  const GradientVarianceRow all{columns, buffer.data(), buffer.data() + stride, size_.width};
  kernels_.gradient_variance_row(all);
  const int to = row / kGradientStep;
  for (int i = 0; i < mean_gradient_.width(); ++i) {
    const int x = std::min(kGradientStep * i + kGradientStep / 2, size_.width - 1);
    const bool known = !std::isnan(disparity_[0].row(row)[kPad + x]);
    mean_gradient_(i, to) = known ? all.mean[x] : kUnknown;
    gradient_difference_(i, to) = known ? all.difference[x] : kUnknown;
  }
}

void SubpixelRefinement::fit_rows(int from, int to, FitBuffers& b) {
  const auto stride = static_cast<std::size_t>(size_.width + kRowPadding);
  const std::size_t column_stride = stride + 2 * kFitRadius;
  b.rows.resize(std::max(b.rows.size(), kFitRows * kWindow * stride));
  b.columns.assign(std::max(b.columns.size(), kFitSums * column_stride), 0);
  const auto row_of = [&](int y) {
    std::int16_t* const first = b.rows.data() + static_cast<std::size_t>(y % kWindow) * kFitRows * stride;
    return std::array<std::int16_t*, kFitRows>{first, first + stride, first + 2 * stride, first + 3 * stride,
                                               first + 4 * stride};
  };
  const auto values_of = [&](int y) {
    const auto row = row_of(y);
    return ColumnUpdate::Row{row[0], row[1], row[2], row[3], row[4]};
  };
  ColumnUpdate update{};
  FitRow fit{};
  for (std::size_t i = 0; i < kFitSums; ++i) {
    update.columns[i] = b.columns.data() + i * column_stride + kFitRadius;
    fit.columns[i] = update.columns[i];
  }
  update.width = fit.width = size_.width;
  fit.noise_levels = kNoise_levels;
  fit.prior_px = kPrior_px;
  fit.least_texture = kLeastTexture;
  fit.least_correlation = kLeastCorrelation;
  const int first = std::max(0, from - kFitRadius), end = std::min(size_.height, to + kFitRadius);
  for (int y = first; y < to + kFitRadius; ++y) {
    const int leaves = y - kWindow;
    const ColumnUpdate::Row out = leaves >= first ? values_of(leaves) : ColumnUpdate::Row{};
    // The row that leaves has the place of the one that comes: it is subtracted first.
    update.add = nullptr;
    update.subtract = leaves >= first ? &out : nullptr;
    if (update.subtract != nullptr) kernels_.update_columns(update);
    if (y < end) {
      const auto to_row = row_of(y);
      kernels_.warp_row({left_.row(y) + kGrayPad, right_.row(y) + kGrayPad, disparity_[0].row(y) + kPad, to_row[0],
                         to_row[1], to_row[2], to_row[3], to_row[4], size_.width});
      const ColumnUpdate::Row in = values_of(y);
      update.add = &in;
      update.subtract = nullptr;
      kernels_.update_columns(update);
    }
    // Sums behind the last column belong to no window.
    for (std::int32_t* const column : update.columns) std::fill_n(column + size_.width, kRowPadding / 4, 0);
    const int centre = y - kFitRadius;
    if (centre < from) continue;
    // The last row of samples may have its centre below the image.
    const int cell = centre / kGradientStep * kGradientStep;
    if (centre == std::min(cell + kGradientStep / 2, size_.height - 1))
      sample_gradients(centre, fit.columns, b.gradients);
    std::copy_n(disparity_[0].row(centre), disparity_[0].width(), disparity_[1].row(centre));
    fit.disparity = disparity_[1].row(centre) + kPad;
    fit.information = information_[1].row(centre) + kPad;
    fit.textured = textured_.row(centre);
    kernels_.fit_row(fit);
    std::fill_n(fit.disparity + size_.width, kPad, kUnknown);
  }
}

void SubpixelRefinement::fit(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right) {
  const auto frame = [&](ImageView<const std::uint8_t> from, Image<std::uint8_t>& to) {
    workers_.parallel_for(0, size_.height, 64, [&](int first, int end) {
      for (int y = first; y < end; ++y) {
        std::uint8_t* const row = to.row(y);
        std::memset(row, from(0, y), kGrayPad);
        std::memcpy(row + kGrayPad, from.row(y), static_cast<std::size_t>(size_.width));
        std::memset(row + kGrayPad + size_.width, from(size_.width - 1, y), kGrayPad);
      }
    });
  };
  frame(left, left_);
  frame(right, right_);
  const int count = (size_.height + kFitBand - 1) / kFitBand, threads = std::min(count, workers_.threads());
  if (static_cast<int>(buffers_.size()) < threads) buffers_.resize(static_cast<std::size_t>(threads));
  workers_.parallel_for_parts(count, [&](int i, int worker) {
    fit_rows(i * kFitBand, std::min(size_.height, (i + 1) * kFitBand), buffers_[static_cast<std::size_t>(worker)]);
  });
  std::swap(disparity_[0], disparity_[1]);
  std::swap(information_[0], information_[1]);
}

void SubpixelRefinement::refine(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right) {
  workers_.parallel_for(0, size_.height, 64, [&](int from, int to) {
    for (int y = from; y < to; ++y) std::fill_n(information_[0].row(y) + kPad, size_.width, 1.0F);
  });
  for (const int step : kStepsBeforeFit) smooth({step, kToleranceBefore_px, kToleranceBefore_px, 0, 0});
  fit(left, right);
  for (const int step : kStepsAfterFit)
    smooth({step, kToleranceAfter_px, kLeastTolerance_px, kToleranceSigmas, kGrowth});
  measure_relief();
}

std::int64_t SubpixelRefinement::memory_bytes(ImageSize size, int threads) {
  const std::int64_t w = size.width, h = size.height;
  const std::int64_t images = h * (3 * (w + 3 * kRowPadding) + 4 * 4 * (w + 2 * kPad + kRowPadding));
  const std::int64_t grid = 2 * 4 * (w / kGradientStep + kRowPadding) * (h / kGradientStep + 1);
  const std::int64_t rows =
      (2 * std::int64_t{kFitRows} * kWindow + 4 * kFitSums + 8) * (w + kRowPadding + 2 * kFitRadius);
  return images + grid + threads * rows;
}

std::size_t SubpixelRefinement::buffer_bytes() const {
  std::size_t total = bytes_of(left_) + bytes_of(right_) + bytes_of(textured_) + bytes_of(mean_gradient_) +
                      bytes_of(gradient_difference_);
  for (const Image<float>& image : disparity_) total += bytes_of(image);
  for (const Image<float>& image : information_) total += bytes_of(image);
  for (const FitBuffers& b : buffers_) total += 2 * b.rows.size() + 4 * (b.columns.size() + b.gradients.size());
  return total;
}

}  // namespace spartan::internal::matching
