// Reads a live stream on a thread of its own, so that no sample waits for the processing of the one before.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "spartan/camera/recording_writer.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/system/internal/sample_queue.h"

namespace spartan::internal {

/// The samples of another stream through a SampleQueue. The thread starts with the first call of read(); its end is
/// awaited in the destructor, which takes as long as a read of `kPoll`.
class QueuedStream : public SampleStream {
 public:
  QueuedStream(SampleStream& stream, const std::string& odometry_pair, std::size_t most_bytes)
      : stream_(stream), queue_(odometry_pair, most_bytes) {}
  ~QueuedStream() override;
  QueuedStream(const QueuedStream&) = delete;
  QueuedStream& operator=(const QueuedStream&) = delete;

  const StreamInfo& info() const override { return stream_.info(); }
  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;
  /// Only after the end.
  DiscardedSamples discarded() const override { return stream_.discarded(); }
  std::vector<CameraPairReport> camera_reports() const override { return stream_.camera_reports(); }
  void start_after(Stamp stamp) override { stream_.start_after(stamp); }
  CameraControl* control() override { return stream_.control(); }
  std::size_t previews(const std::string& pair) const override { return stream_.previews(pair); }
  Result<StereoFrame> preview(const std::string& pair, std::size_t index) override {
    return stream_.preview(pair, index);
  }
  /// Records every sample as it arrives. Before the first call of read().
  void record_with(std::unique_ptr<StreamRecorder> recorder) { recorder_ = std::move(recorder); }
  /// Null where nothing is recorded.
  StreamRecorder* recorder() { return recorder_.get(); }
  /// Ends the thread; the samples in the queue can still be read.
  void stop();
  DroppedFrames dropped() const { return queue_.dropped(); }
  std::size_t peak_bytes() const { return queue_.peak_bytes(); }

  static constexpr std::chrono::milliseconds kPoll{50};

 private:
  void pump();

  SampleStream& stream_;
  std::unique_ptr<StreamRecorder> recorder_;
  SampleQueue queue_;
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace spartan::internal
