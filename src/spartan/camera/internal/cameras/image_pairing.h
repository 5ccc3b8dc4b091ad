// Images of the left and the right camera of a pair that were taken at the same time.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "spartan/camera/internal/cameras/camera_device.h"
#include "spartan/core/time.h"

namespace spartan::internal {

/// An image on the clock of the host.
struct StampedImage {
  CameraImage image;
  Stamp stamp;                ///< mid-exposure
  bool trusted = true;        ///< false: `stamp` follows from the arrival (MappedStamp::trusted)
  double sigma_s = 0;         ///< of the stamp
  std::int64_t trigger = -1;  ///< number of the trigger that it answers, the same for both cameras; −1: none
};

/// At least one image.
struct ImagePair {
  std::array<std::optional<StampedImage>, 2> images;  ///< left, right
  bool is_complete() const { return images[0] && images[1]; }
  /// The left one, else the right one.
  const StampedImage& first() const { return images[0] ? *images[0] : *images[1]; }
};

/// Images that answer the same trigger belong together. Without triggers they do where their stamps differ by less than
/// a tolerance, which grows up to twofold with the standard deviation of that difference. Where one of the stamps is
/// not trusted, the frame ids decide: their difference is that of the last kLearned pairs with trusted stamps. So a
/// wrong stamp harms at most its own pair, and a camera that leaves out images, or counts from a new start, is
/// followed.
///
/// Images of one camera come in order. One without a partner is returned alone, when its partner can no longer come:
/// the other camera has delivered a later one, or `wait` has passed.
class ImagePairing {
 public:
  using Time = std::chrono::steady_clock::time_point;

  ImagePairing(double tolerance_s, std::chrono::nanoseconds wait) : tolerance_s_(tolerance_s), wait_(wait) {}

  /// Of the left (0) or right (1) camera.
  void add(int side, StampedImage image) { waiting_[side_of(side)].push_back(std::move(image)); }
  std::size_t waiting(int side) const { return waiting_[side_of(side)].size(); }
  void drop_oldest(int side) { waiting_[side_of(side)].pop_front(); }
  /// Whether the stamps of a complete pair differ by more than the tolerance, as after a trigger that came late.
  bool is_apart(const ImagePair& pair) const;
  /// The next pair, in order of time.
  std::optional<ImagePair> take(Time now);
  /// When take() may return an image that has waited for long enough. None: nothing waits.
  std::optional<Time> next_timeout() const;

  static constexpr int kLearned = 3;

 private:
  static std::size_t side_of(int side) { return side == 0 ? 0 : 1; }
  /// Less than 0: the left one has no partner; more: the right one; 0: they are a pair.
  int compare(const StampedImage& left, const StampedImage& right);
  double tolerance_s(const StampedImage& left, const StampedImage& right) const;
  void learn(std::int64_t difference);
  ImagePair take_one(std::size_t side);

  double tolerance_s_;
  std::chrono::nanoseconds wait_;
  std::array<std::deque<StampedImage>, 2> waiting_;
  // Frame id of the right image minus that of the left one.
  std::optional<std::int64_t> id_difference_, candidate_;
  int times_seen_ = 0;
};

}  // namespace spartan::internal
