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
#include "spartan/reconstruction/internal/matching/texture_support.h"

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
  matching::TextureSupport texture_support;
  SpeckleFilter speckles;
  Image<std::uint8_t> right_distance, outlier_percent;

  void resize(ImageSize size) {
    refinement.resize(size);
    if (outlier_percent.size() == size) return;
    outlier_percent = {};  // stays so if an allocation fails
    right_distance = Image<std::uint8_t>(size);
    outlier_percent = Image<std::uint8_t>(size);
  }
  std::size_t buffer_bytes() const {
    return matcher.buffer_bytes() + block_matcher.buffer_bytes() + refinement.buffer_bytes() + speckles.buffer_bytes() +
           texture_support.buffer_bytes() + matching::bytes_of(right_distance) + matching::bytes_of(outlier_percent);
  }
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
  s.resize(left.size());
  const ImageView<float> disparity = s.refinement.disparity();
  const matching::Matches matches{s.options.median ? s.refinement.spare() : disparity, s.right_distance};
  DisparityImage result;
  DisparityTimes& times = result.times;
  if (s.options.method == MatchingMethod::block) {
    s.block_matcher.match(left, right, range, matches);
  } else {
    s.matcher.match(left, right, range, matches);
    times.coarse = s.matcher.coarse_ms();
  }
  times.match = watch.lap() - times.coarse;
  apply_masks(left_mask, right_mask, matches.disparity);
  if (s.options.median) median_3x3(matches.disparity, s.kernels.median_row, s.workers, disparity);
  times.filter = watch.lap();
  s.refinement.refine(left, right);
  // Sigma takes the place of the information that it follows from.
  const ImageView<float> information = s.refinement.information();
  const matching::Assessed assessed{s.refinement.disparity(), information, s.outlier_percent, s.refinement.textured()};
  matching::assess({information, s.refinement.relief(), s.right_distance, s.options.max_outlier_percent}, s.kernels,
                   s.workers, assessed);
  // The right distances are of no more use.
  s.texture_support.assess(s.refinement.gradients(), left, s.right_distance, s.workers, assessed.outlier_percent);
  times.refine = watch.lap();
  s.speckles.apply({s.options.speckle_size_px, s.options.speckle_step_px, assessed.reliable}, s.workers,
                   assessed.disparity);
  matching::clear_unknown(s.workers, assessed);
  if (s.options.fill) {
    fill_unknown(s.workers, assessed.disparity);
    apply_masks(left_mask, {}, assessed.disparity);
  }
  times.filter += watch.lap();
  times.total = all.lap();
  result.disparity = assessed.disparity;
  result.sigma = assessed.sigma;
  result.outlier_percent = assessed.outlier_percent;
  result.buffer_bytes = s.buffer_bytes();
  return result;
}

std::int64_t DisparityComputer::memory_bytes(ImageSize size, DisparityRange range, int threads) {
  // Per pixel: two images of 1 byte, and the labels and runs of the speckle filter (16 bytes).
  return std::max(matching::CoarseToFineMatcher::memory_bytes(size, range, threads),
                  matching::BlockMatcher::memory_bytes(size, threads)) +
         matching::SubpixelRefinement::memory_bytes(size, threads) + matching::TextureSupport::memory_bytes(size) +
         std::int64_t{18} * size.width * size.height;
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
