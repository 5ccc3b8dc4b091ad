// Base of streams that change the samples of another one.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "spartan/camera/sample_stream.h"

namespace spartan {

/// All but read() is that of the stream behind it, which is borrowed.
class StreamDecorator : public SampleStream {
 public:
  explicit StreamDecorator(SampleStream& behind) : behind_(behind) {}

  const StreamInfo& info() const override { return behind_.info(); }
  DiscardedSamples discarded() const override { return behind_.discarded(); }
  std::vector<CameraPairReport> camera_reports() const override { return behind_.camera_reports(); }
  CameraControl* control() override { return behind_.control(); }
  PanTiltControl* pan_tilt() override { return behind_.pan_tilt(); }
  void start_after(Stamp stamp) override { behind_.start_after(stamp); }
  std::size_t previews(const std::string& pair) const override { return behind_.previews(pair); }
  Result<StereoFrame> preview(const std::string& pair, std::size_t index) override {
    return behind_.preview(pair, index);
  }

 protected:
  SampleStream& behind() { return behind_; }
  const SampleStream& behind() const { return behind_; }

 private:
  SampleStream& behind_;
};

}  // namespace spartan
