#include "spartan/eval/disparity_metrics.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace spartan {
namespace {

// Counts and sums over the pixels of one kind, from which the scores are computed.
class ErrorCounts {
 public:
  void add(float estimate, float truth) {
    ++truth_;
    if (!std::isfinite(estimate)) return;
    ++matched_;
    const double error = std::abs(static_cast<double>(estimate) - static_cast<double>(truth));
    absolute_sum_ += error;
    for (std::size_t i = 0; i < kThresholds.size(); ++i) above_[i] += error > kThresholds[i];
    if (error <= 1.0) {
      ++within_1px_;
      squares_within_1px_ += error * error;
    }
  }

  DisparityScores scores() const {
    const auto bad = [&](std::size_t i) { return percent(truth_ - matched_ + above_[i], truth_); };
    DisparityScores s;
    s.truth_pixels = truth_;
    s.matched_pixels = matched_;
    s.bad_0_5 = bad(0);
    s.bad_1 = bad(1);
    s.bad_2 = bad(2);
    s.bad_3 = bad(3);
    s.matched_bad_1 = percent(above_[1], matched_);
    s.matched_bad_2 = percent(above_[2], matched_);
    s.density_percent = percent(matched_, truth_);
    if (within_1px_ > 0) s.rms_in_1px = std::sqrt(squares_within_1px_ / static_cast<double>(within_1px_));
    if (matched_ > 0) s.mean_abs_px = absolute_sum_ / static_cast<double>(matched_);
    return s;
  }

 private:
  static constexpr std::array<double, 4> kThresholds{0.5, 1.0, 2.0, 3.0};

  static std::optional<double> percent(std::int64_t part, std::int64_t whole) {
    if (whole == 0) return std::nullopt;
    return 100.0 * static_cast<double>(part) / static_cast<double>(whole);
  }

  std::int64_t truth_ = 0, matched_ = 0, within_1px_ = 0;
  std::array<std::int64_t, kThresholds.size()> above_{};
  double absolute_sum_ = 0, squares_within_1px_ = 0;
};

Status check_size(const char* name, ImageSize size, ImageSize expected) {
  if (size == expected) return {};
  return failure(ErrorCode::input, fmt::format("the {} has {}×{} pixels, the disparity image {}×{}", name, size.width,
                                               size.height, expected.width, expected.height));
}

}  // namespace

Result<DisparityMetrics> compare_disparities(ImageView<const float> estimate, ImageView<const float> truth,
                                             ImageView<const std::uint8_t> mask) {
  if (const Status same = check_size("truth", truth.size(), estimate.size()); !same) return failure(same);
  if (!mask.empty()) {
    if (const Status same = check_size("mask", mask.size(), estimate.size()); !same) return failure(same);
  }
  ErrorCounts all, nonocc;
  for (int y = 0; y < truth.height(); ++y) {
    for (int x = 0; x < truth.width(); ++x) {
      const std::uint8_t kind = mask.empty() ? kMaskSeenByBoth : mask(x, y);
      if (!std::isfinite(truth(x, y)) || kind == kMaskNoTruth) continue;
      all.add(estimate(x, y), truth(x, y));
      if (kind == kMaskSeenByBoth) nonocc.add(estimate(x, y), truth(x, y));
    }
  }
  DisparityMetrics metrics{all.scores(), std::nullopt};
  if (!mask.empty()) metrics.nonocc = nonocc.scores();
  return metrics;
}

}  // namespace spartan
