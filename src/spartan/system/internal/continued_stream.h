// A live stream of a run that is resumed.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

#include "spartan/camera/sample_stream.h"
#include "spartan/core/log.h"

namespace spartan::internal {

/// Stamps of cameras are those of the computer's clock, which may have gone back since the run was interrupted: one
/// without a battery begins anew with the power. Where the first sample of the stream behind is not after the stamp of
/// start_after(), all stamps are moved by the same time, so that it is a second after it.
class ContinuedStream : public StreamDecorator {
 public:
  ContinuedStream(SampleStream& stream, Log log) : StreamDecorator(stream), log_(std::move(log)) {}

  Result<StreamRead> read(std::chrono::nanoseconds timeout) override;
  void start_after(Stamp stamp) override;

 private:
  Log log_;
  std::optional<Stamp> latest_;  // until the first sample
  std::int64_t moved_ns_ = 0;
};

}  // namespace spartan::internal
