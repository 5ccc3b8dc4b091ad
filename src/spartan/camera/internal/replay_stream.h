// A recording as a live stream: its samples arrive at the pace at which they were taken.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "spartan/camera/recording.h"
#include "spartan/camera/sample_stream.h"

namespace spartan::internal {

/// Time and waiting, so that tests need not wait.
struct ReplayClock {
  using Time = std::chrono::steady_clock::time_point;
  std::function<Time()> now;
  std::function<void(Time)> wait_until;

  static ReplayClock real();
};

/// The first sample arrives with the first call of read(), each other one as much later as its stamp says, divided by
/// `speed`. A thread of low priority reads and decodes up to kAhead samples before their time has come, so that
/// decoding, which a camera does not need, hardly disturbs what is measured. A sample that could not be read in time
/// arrives when it is read. After the last sample the recording begins again, `passes` times in all: stamps, frame ids,
/// stops and the distances of the wheels go on.
class ReplayStream : public SampleStream {
 public:
  /// `speed` > 0, `passes` ≥ 1.
  ReplayStream(std::unique_ptr<Recording> recording, double speed, int passes, ReplayClock clock = ReplayClock::real());
  ~ReplayStream() override;
  ReplayStream(const ReplayStream&) = delete;
  ReplayStream& operator=(const ReplayStream&) = delete;

  const StreamInfo& info() const override { return info_; }
  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;
  bool is_repeatable() const override { return true; }
  void start_after(Stamp stamp) override { start_after_ = stamp; }
  DiscardedSamples discarded() const override;
  /// Only before the first call of read().
  std::size_t previews(const std::string& pair) const override { return recording_->previews(pair); }
  Result<StereoFrame> preview(const std::string& pair, std::size_t index) override {
    return recording_->preview(pair, index);
  }

  static constexpr std::size_t kAhead = 64;        ///< samples
  static constexpr std::size_t kFramesAhead = 12;  ///< of those

 private:
  // What is added to the samples of a pass, and how far the samples have come.
  struct Progress {
    Stamp stamp;
    std::int64_t frame_id = 0, position_id = 0;
    double left_m = 0, right_m = 0;
  };

  void read_ahead();
  Result<std::optional<Sample>> fetch();
  Result<std::optional<Sample>> fetch_any();
  bool has_room() const { return ahead_.size() < kAhead && frames_ahead_ < kFramesAhead; }
  void shift(Sample& sample) const;
  void note(const Sample& sample);
  ReplayClock::Time due(Stamp stamp) const;

  std::unique_ptr<Recording> recording_;
  StreamInfo info_;
  double speed_;
  int passes_left_;
  ReplayClock clock_;
  std::optional<Stamp> start_after_;
  std::optional<ReplayClock::Time> start_;
  std::optional<Stamp> start_stamp_;

  // Of the thread.
  std::optional<Stamp> first_stamp_;         // of the recording
  std::optional<WheelSample> first_wheels_;  // of the recording
  Progress offset_, last_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Sample> ahead_;
  std::size_t frames_ahead_ = 0;
  DiscardedSamples discarded_;
  bool stopped_ = false, ended_ = false;
  Status status_;  // why it has ended
  std::thread thread_;
};

}  // namespace spartan::internal
