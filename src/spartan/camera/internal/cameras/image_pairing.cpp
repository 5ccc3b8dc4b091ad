#include "spartan/camera/internal/cameras/image_pairing.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace spartan::internal {

std::optional<ImagePair> ImagePairing::take(Time now) {
  auto& [left, right] = waiting_;
  if (!left.empty() && !right.empty()) {
    const int order = compare(left.front(), right.front());
    if (order != 0) return take_one(order < 0 ? 0 : 1);
    ImagePair pair = take_one(0);
    pair.images[1] = std::move(right.front());
    right.pop_front();
    return pair;
  }
  for (std::size_t side = 0; side < 2; ++side) {
    if (!waiting_[side].empty() && now - waiting_[side].front().image.complete >= wait_) return take_one(side);
  }
  return std::nullopt;
}

std::optional<ImagePairing::Time> ImagePairing::next_timeout() const {
  std::optional<Time> first;
  for (const auto& waiting : waiting_) {
    if (waiting.empty()) continue;
    const Time time = waiting.front().image.complete + wait_;
    first = first ? std::min(*first, time) : time;
  }
  return first;
}

ImagePair ImagePairing::take_one(std::size_t side) {
  ImagePair pair;
  pair.images[side] = std::move(waiting_[side].front());
  waiting_[side].pop_front();
  return pair;
}

double ImagePairing::tolerance_s(const StampedImage& left, const StampedImage& right) const {
  const double sigmas_s = 2 * std::hypot(left.sigma_s, right.sigma_s);
  return tolerance_s_ + std::min(sigmas_s, tolerance_s_);
}

bool ImagePairing::is_apart(const ImagePair& pair) const {
  const StampedImage &left = *pair.images[0], &right = *pair.images[1];
  if (!left.trusted || !right.trusted) return false;
  return std::abs(seconds_between(left.stamp, right.stamp)) > tolerance_s(left, right);
}

int ImagePairing::compare(const StampedImage& left, const StampedImage& right) {
  if (left.trigger >= 0 && right.trigger >= 0) {
    if (left.trigger == right.trigger) return 0;
    return left.trigger < right.trigger ? -1 : 1;
  }
  const bool trusted = left.trusted && right.trusted;
  const bool counted = left.image.frame_id >= 0 && right.image.frame_id >= 0;
  const std::int64_t difference = right.image.frame_id - left.image.frame_id;
  if (!trusted && counted && id_difference_) {
    if (difference == *id_difference_) return 0;
    return difference > *id_difference_ ? -1 : 1;
  }
  const double later_s = seconds_between(left.stamp, right.stamp);
  if (std::abs(later_s) > tolerance_s(left, right)) return later_s > 0 ? -1 : 1;
  if (trusted && counted) learn(difference);
  return 0;
}

void ImagePairing::learn(std::int64_t difference) {
  times_seen_ = candidate_ == difference ? times_seen_ + 1 : 1;
  candidate_ = difference;
  if (times_seen_ >= kLearned) id_difference_ = difference;
}

}  // namespace spartan::internal
