// The rest of what a live run had recorded before it was interrupted, and then its live stream.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/camera/sample_stream.h"
#include "spartan/system/internal/queued_stream.h"

namespace spartan::internal {

/// Recorded samples come at once, the live ones when they arrive. Samples that the run had processed, or that are in a
/// recording and come again, are skipped: those whose stamps are not after the last one of their source. Numbers of
/// live frames, also in their recording, go on after all those before.
class ResumedStream : public StreamDecorator {
 public:
  /// `recordings`: in their order. `live` is borrowed.
  ResumedStream(std::vector<std::unique_ptr<Recording>> recordings, QueuedStream& live)
      : StreamDecorator(live), live_(live), recordings_(std::move(recordings)) {}

  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;

  /// Before the first call of read(): the latest stamps that were processed, by source_of(), and the number of the last
  /// frame.
  void skip_until(std::map<std::string, Stamp> last, std::int64_t last_id) {
    last_ = std::move(last);
    last_id_ = last_id;
  }
  /// Whether the next sample may be a recorded one.
  bool is_catching_up() const { return next_ < recordings_.size(); }
  /// A recorded frame. Code `input` where none has this stamp.
  Result<StereoFrame> frame_at(const std::string& pair, Stamp left_stamp);

 private:
  bool is_new(const std::string& source, Stamp stamp);

  QueuedStream& live_;
  std::vector<std::unique_ptr<Recording>> recordings_;
  std::size_t next_ = 0;  // recording that is read
  std::map<std::string, Stamp> last_;
  std::int64_t last_id_ = -1;
  bool live_has_begun_ = false;
};

}  // namespace spartan::internal
