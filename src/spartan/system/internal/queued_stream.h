// Reads a live stream on a thread of its own, so that no sample waits for the processing of the one before.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "spartan/camera/recording_writer.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/system/internal/sample_queue.h"

namespace spartan::internal {

/// The samples of another stream through a SampleQueue. The thread starts with the first call of read(); its end is
/// awaited in the destructor, which takes as long as a read of `kPoll`. Only after the end is
/// discarded() that of the stream.
class QueuedStream : public StreamDecorator {
 public:
  QueuedStream(SampleStream& stream, const std::string& odometry_pair, std::size_t most_bytes,
               std::chrono::nanoseconds longest_wait = {})
      : StreamDecorator(stream), queue_(odometry_pair, most_bytes, longest_wait) {}
  ~QueuedStream() override;
  QueuedStream(const QueuedStream&) = delete;
  QueuedStream& operator=(const QueuedStream&) = delete;

  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;
  /// Records every sample as it arrives. Before the first call of read().
  void record_with(std::unique_ptr<StreamRecorder> recorder) { recorder_ = std::move(recorder); }
  /// Numbers of frames, also in the recording, go on after this one. Before the first call of read().
  void number_after(std::int64_t last_id) { last_id_ = last_id; }
  /// Null where nothing is recorded.
  StreamRecorder* recorder() { return recorder_.get(); }
  /// Ends the thread; the samples in the queue can still be read.
  void stop();
  DroppedFrames dropped() const { return queue_.dropped(); }
  std::size_t peak_bytes() const { return queue_.peak_bytes(); }

  static constexpr std::chrono::milliseconds kPoll{50};

 private:
  void pump();
  void number(Sample& sample);

  std::unique_ptr<StreamRecorder> recorder_;
  SampleQueue queue_;
  std::optional<std::int64_t> last_id_, id_offset_;  // offset: from the first frame on
  std::atomic<bool> stop_ = false;
  std::thread thread_;
};

}  // namespace spartan::internal
