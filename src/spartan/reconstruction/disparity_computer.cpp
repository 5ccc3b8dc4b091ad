#include "spartan/reconstruction/disparity_computer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/core/stage_clock.h"
#include "spartan/numerics/simd_target.h"
#include "spartan/reconstruction/internal/disparity_filters.h"
#include "spartan/reconstruction/internal/matching/block_matcher.h"
#include "spartan/reconstruction/internal/matching/coarse_to_fine_matcher.h"
#include "spartan/reconstruction/internal/matching/image_bytes.h"
#include "spartan/reconstruction/internal/matching/reliability.h"
#include "spartan/reconstruction/internal/matching/subpixel_refinement.h"

namespace spartan {

using namespace internal;

struct DisparityComputer::State {
  State(const DisparityOptions& options_in, const ThreadPool& workers_in)
      : options(options_in),
        workers(workers_in),
        kernels(matching::refinement_kernels_for(simd_target_index(options_in.simd))),
        matcher(options_in, workers_in),
        block_matcher(matching::block_kernels_for(simd_target_index(options_in.simd)), workers_in),
        refinement(kernels, workers_in) {}
  DisparityOptions options;
  ThreadPool workers;
  matching::RefinementKernels kernels;
  matching::CoarseToFineMatcher matcher;
  matching::BlockMatcher block_matcher;
  matching::SubpixelRefinement refinement;
  SpeckleFilter speckles;
  Image<float> disparity, sigma;  // sigma is also the output of the median filter
  Image<std::uint8_t> outlier_percent;
};

Result<DisparityComputer> DisparityComputer::create(const DisparityOptions& options, ThreadPool workers) {
  if (Status valid = validate(options, "disparity options"); !valid) return failure(valid);
  return DisparityComputer(std::make_unique<State>(options, std::move(workers)));
}

DisparityComputer::DisparityComputer(std::unique_ptr<State> state) : state_(std::move(state)) {}
DisparityComputer::DisparityComputer(DisparityComputer&&) noexcept = default;
DisparityComputer& DisparityComputer::operator=(DisparityComputer&&) noexcept = default;
DisparityComputer::~DisparityComputer() = default;

Status DisparityComputer::check(ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                DisparityRange range, ImageView<const std::uint8_t> left_mask,
                                ImageView<const std::uint8_t> right_mask) {
  if (left.empty() || left.size() != right.size()) {
    return failure(ErrorCode::frame_rejected,
                   fmt::format("the left image has {}x{} pixels, the right one {}x{}", left.width(), left.height(),
                               right.width(), right.height()),
                   {}, "rectify both images of a pair to the same size");
  }
  const auto fits = [&](ImageView<const std::uint8_t> mask) { return mask.empty() || mask.size() == left.size(); };
  if (!fits(left_mask) || !fits(right_mask))
    return failure(ErrorCode::frame_rejected, "the size of a mask differs from the size of the images");
  if (range.count() < 1 || range.max >= left.width() || range.min <= -left.width()) {
    return failure(ErrorCode::frame_rejected,
                   fmt::format("the disparity search range {} … {} px is empty or wider than the image ({} px)",
                               range.min, range.max, left.width()));
  }
  return {};
}

Result<DisparityImage> DisparityComputer::compute(ImageView<const std::uint8_t> left,
                                                  ImageView<const std::uint8_t> right, DisparityRange range,
                                                  ImageView<const std::uint8_t> left_mask,
                                                  ImageView<const std::uint8_t> right_mask) {
  if (Status fits = check(left, right, range, left_mask, right_mask); !fits) return failure(fits);
  Stopwatch all, watch;
  State& s = *state_;
  if (s.outlier_percent.size() != left.size()) {
    s.outlier_percent = {};  // stays so if an allocation fails
    for (Image<float>* image : {&s.disparity, &s.sigma}) *image = Image<float>(left.size());
    s.outlier_percent = Image<std::uint8_t>(left.size());
  }
  DisparityImage result;
  DisparityTimes& times = result.times;
  const bool by_blocks = s.options.method == MatchingMethod::block;
  const matching::Matches& matches =
      by_blocks ? s.block_matcher.match(left, right, range) : s.matcher.match(left, right, range);
  times.coarse = by_blocks ? 0 : s.matcher.coarse_ms();
  times.match = watch.lap() - times.coarse;
  s.workers.parallel_for(0, left.height(), 64, [&](int from, int to) {
    for (int y = from; y < to; ++y) std::copy_n(matches.disparity.row(y), left.width(), s.disparity.row(y));
  });
  apply_masks(left_mask, right_mask, s.disparity);
  if (s.options.median) {
    median_3x3(s.disparity, s.kernels.median_row, s.workers, s.sigma);
    std::swap(s.disparity, s.sigma);
  }
  times.filter = watch.lap();
  s.refinement.refine(left, right, s.disparity);
  const matching::Assessed assessed{s.disparity, s.sigma, s.outlier_percent, s.refinement.textured()};
  matching::assess(
      {s.refinement.information(), s.refinement.relief(), matches.right_distance, s.options.max_outlier_percent},
      s.kernels, s.workers, assessed);
  times.refine = watch.lap();
  s.speckles.apply({s.options.speckle_size_px, s.options.speckle_step_px, assessed.reliable}, s.workers, s.disparity);
  matching::clear_unknown(s.workers, assessed);
  if (s.options.fill) {
    fill_unknown(s.workers, s.disparity);
    apply_masks(left_mask, {}, s.disparity);
  }
  times.filter += watch.lap();
  times.total = all.lap();
  result.disparity = s.disparity.view();
  result.sigma = s.sigma.view();
  result.outlier_percent = s.outlier_percent.view();
  result.buffer_bytes = s.matcher.buffer_bytes() + s.block_matcher.buffer_bytes() + s.refinement.buffer_bytes() +
                        s.speckles.buffer_bytes() + matching::bytes_of(s.disparity) + matching::bytes_of(s.sigma) +
                        matching::bytes_of(s.outlier_percent);
  return result;
}

std::int64_t DisparityComputer::memory_bytes(ImageSize size, DisparityRange range, int threads) {
  // Per pixel: two images of 4 bytes and one of 1 byte, and the labels and runs of the speckle filter (16 bytes).
  return std::max(matching::CoarseToFineMatcher::memory_bytes(size, range, threads),
                  matching::BlockMatcher::memory_bytes(size, threads)) +
         matching::SubpixelRefinement::memory_bytes(size, threads) + std::int64_t{25} * size.width * size.height;
}

Status DisparityComputer::check_memory(ImageSize size, DisparityRange range, int threads, std::int64_t most_bytes) {
  const std::int64_t needed = memory_bytes(size, range, threads);
  if (most_bytes <= 0 || needed <= most_bytes) return {};
  return failure(
      ErrorCode::resources,
      fmt::format("images of {}x{} px with {} disparities need {:.0f} MB of memory, more than the bound of "
                  "{:.0f} MB",
                  size.width, size.height, range.count(), 1e-6 * static_cast<double>(needed),
                  1e-6 * static_cast<double>(most_bytes)),
      "", "use smaller images or a smaller disparity range (nearest_m of the pair in rig.yaml), or raise --memory");
}

DisparityRange disparity_range(const RectifiedStereo& geometry, double nearest_m) {
  const double wanted =
      nearest_m > 0 ? geometry.focal_px * geometry.baseline_m / nearest_m : 0.25 * geometry.size.width;
  const int count = (static_cast<int>(std::ceil(std::min(wanted, 0.75 * geometry.size.width))) + 16) / 16 * 16;
  return {0, std::max(0, std::min(count, geometry.size.width) - 1)};
}

}  // namespace spartan
