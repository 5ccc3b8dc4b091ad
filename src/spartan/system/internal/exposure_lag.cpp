#include "spartan/system/internal/exposure_lag.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace spartan::internal {
namespace {

constexpr double kDark = 0.01, kBright = 0.99;  // beyond them a median does not follow the light
constexpr double kLeastChange = 0.05;           // of the logarithm of a product, for a direction
constexpr double kClearly = 0.3;                // of logarithms: by so much, and by half, another lag must be better

}  // namespace

double ExposureLag::Frame::product_us() const {
  return stated.exposure_us * std::max(stated.gain, 1.0);
}

ExposureSettings ExposureLag::add(const GroundBrightness& ground, const ExposureSettings& stated) {
  if (!(stated.exposure_us > 0)) return stated;
  frames_.push_back({ground.median, stated});
  if (frames_.size() > kFrames + kMostLag) frames_.pop_front();
  if (reversals() >= kReversals) {
    const double now = to_and_fro(lag_);
    double best = std::min(now - kClearly, 0.5 * now);
    for (std::size_t lag = 0; lag <= kMostLag; ++lag) {
      const double here = to_and_fro(lag);
      if (here >= best) continue;
      best = here;
      lag_ = lag;
    }
  }
  return frames_[frames_.size() - 1 - std::min(lag_, frames_.size() - 1)].stated;
}

int ExposureLag::reversals() const {
  int reversals = 0;
  double direction = 0;
  for (std::size_t i = 1; i < frames_.size(); ++i) {
    const double change = std::log(frames_[i].product_us() / frames_[i - 1].product_us());
    if (std::abs(change) < kLeastChange) continue;
    if (change * direction < 0) ++reversals;
    direction = change;
  }
  return reversals;
}

// The way of the light's logarithm, without the shortest one from its begin to its end.
double ExposureLag::to_and_fro(std::size_t lag) const {
  std::optional<double> first, last;
  double way = 0;
  for (std::size_t i = kMostLag; i < frames_.size(); ++i) {
    if (frames_[i].median < kDark || frames_[i].median > kBright) continue;
    const double light = std::log(frames_[i].median / frames_[i - lag].product_us());
    way += std::abs(light - last.value_or(light));
    first = first.value_or(light);
    last = light;
  }
  return first ? way - std::abs(*last - *first) : 0;
}

}  // namespace spartan::internal
