// A recording as a live stream: its samples arrive at the pace at which they were taken.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

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
/// `speed`. An image is decoded while its time has not come. A sample that could not be read in time arrives when it is
/// read. After the last sample the recording begins again, `passes` times in all: stamps, frame ids, stops and the
/// distances of the wheels go on.
class ReplayStream : public SampleStream {
 public:
  /// `speed` > 0, `passes` ≥ 1.
  ReplayStream(std::unique_ptr<Recording> recording, double speed, int passes, ReplayClock clock = ReplayClock::real());

  const StreamInfo& info() const override { return info_; }
  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;
  DiscardedSamples discarded() const override { return recording_->discarded(); }
  std::size_t previews(const std::string& pair) const override { return recording_->previews(pair); }
  Result<StereoFrame> preview(const std::string& pair, std::size_t index) override {
    return recording_->preview(pair, index);
  }

 private:
  // What is added to the samples of a pass, and how far the samples have come.
  struct Progress {
    Stamp stamp;
    std::int64_t frame_id = 0, position_id = 0;
    double left_m = 0, right_m = 0;
  };

  Status fetch();
  void shift(Sample& sample) const;
  void note(const Sample& sample);
  ReplayClock::Time due(Stamp stamp) const;

  std::unique_ptr<Recording> recording_;
  StreamInfo info_;
  double speed_;
  int passes_left_;
  ReplayClock clock_;
  std::optional<Sample> next_;
  bool ended_ = false;
  std::optional<ReplayClock::Time> start_;
  std::optional<Stamp> first_stamp_;  // of the recording
  Progress offset_, last_;
};

}  // namespace spartan::internal
