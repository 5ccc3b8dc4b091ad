#include "spartan/reconstruction/disparity_computer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "spartan/core/stage_clock.h"
#include "spartan/reconstruction/internal/disparity_filters.h"
#include "spartan/reconstruction/internal/semi_global_matcher.h"

namespace spartan {

using namespace internal;

struct DisparityComputer::State {
  State(const DisparityOptions& options_in, const ThreadPool& workers_in)
      : options(options_in), workers(workers_in), matcher(options_in, workers_in) {}
  DisparityOptions options;
  ThreadPool workers;
  SemiGlobalMatcher matcher;
  SpeckleFilter speckles;
  Image<float> checked, smoothed;
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
  if (s.checked.size() != left.size()) {
    s.checked = Image<float>(left.size());
    s.smoothed = Image<float>(left.size());
  }
  DisparityImage result;
  const RawDisparity& raw = s.matcher.match(left, right, range);
  result.times = s.matcher.times();
  watch.lap();
  drop_inconsistent(raw, s.options.left_right_px, s.workers, s.checked);
  apply_masks(left_mask, right_mask, s.checked);
  result.times.check = watch.lap();
  if (s.options.median) {
    median_3x3(s.checked, s.workers, s.smoothed);
  } else {
    std::swap(s.checked, s.smoothed);
  }
  s.speckles.apply(s.options.speckle_size_px, s.options.speckle_step_px, s.smoothed);
  result.times.filter = watch.lap();
  result.times.total = all.lap();
  result.disparity = s.smoothed.view();
  result.buffer_bytes = s.matcher.buffer_bytes();
  return result;
}

std::int64_t DisparityComputer::memory_bytes(ImageSize size, DisparityRange range) {
  // Per pixel: the checked and the smoothed disparity (4 bytes each), labels and stack of the speckle filter (12
  // bytes).
  return SemiGlobalMatcher::memory_bytes(size, range) + std::int64_t{20} * size.width * size.height;
}

Status DisparityComputer::check_memory(ImageSize size, DisparityRange range, std::int64_t most_bytes) {
  const std::int64_t needed = memory_bytes(size, range);
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
