// A bounded queue from the thread that reads a live stream to the one that processes its samples.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>

#include "spartan/camera/sample_stream.h"
#include "spartan/core/result.h"

namespace spartan::internal {

/// Frames that did not fit into a SampleQueue.
struct DroppedFrames {
  std::int64_t views = 0;     ///< of pairs other than that of the odometry
  std::int64_t odometry = 0;  ///< of the pair of the odometry
  std::int64_t sensor_samples = 0;
};

/// Keeps the order of arrival. Where the images would exceed `most_bytes`, the oldest view of another pair than that of
/// the odometry loses its images; where there is none, the oldest frame of the odometry does. Such a frame is delivered
/// as MissingFrame (`dropped`; a frame of one image keeps its fault). So it is where a frame is taken that has waited
/// for longer than `longest_wait` (0: no limit): the poses of a computer that is too slow are old by no more than that.
/// The oldest sensor sample beyond `kMostSensorSamples` is dropped. Thread-safe for one producer and one consumer.
class SampleQueue {
 public:
  SampleQueue(std::string odometry_pair, std::size_t most_bytes, std::chrono::nanoseconds longest_wait = {})
      : odometry_pair_(std::move(odometry_pair)), most_bytes_(most_bytes), longest_wait_(longest_wait) {}

  void push(StreamRead read);
  /// No sample will follow: the stream ended, or failed.
  void close(Status reason);

  /// The next sample, waiting for it at most `timeout`. The error of close() comes after all samples.
  Result<StreamRead> pop(std::chrono::nanoseconds timeout);

  DroppedFrames dropped() const;
  /// Largest number of bytes of images that were in the queue.
  std::size_t peak_bytes() const;

  static constexpr std::size_t kMostSensorSamples = 100'000;

 private:
  bool drop_oldest(bool view, const std::string& reason);
  void make_room();
  void drop_if_late(std::chrono::steady_clock::time_point now);

  const std::string odometry_pair_;
  const std::size_t most_bytes_;
  const std::chrono::nanoseconds longest_wait_;
  mutable std::mutex mutex_;
  std::condition_variable arrived_;
  std::deque<StreamRead> reads_;
  std::size_t bytes_ = 0, peak_bytes_ = 0, sensor_samples_ = 0;
  bool closed_ = false;
  Status reason_;
  DroppedFrames dropped_;
};

}  // namespace spartan::internal
