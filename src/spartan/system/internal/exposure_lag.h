// By how many frames the settings that frames state are ahead of those that they were taken with.
#pragma once

#include <cstddef>
#include <deque>

#include "spartan/camera/sample_stream.h"
#include "spartan/imaging/exposure_control.h"

namespace spartan::internal {

/// A driver that knows only what was last set states it also for images that were exposed before, and a sensor may take
/// a setting over a frame late. A control that trusts such frames applies each factor again, and never settles.
///
/// The light is the brightness of the ground over the product of exposure and gain. With the wrong lag each change of
/// the settings lets it jump and jump back; the lag with the least to and fro over the last kFrames is the right one.
/// It is chosen anew only where the control has turned back kReversals times within them, so that settings which frames
/// state rightly are never doubted.
class ExposureLag {
 public:
  /// Of the frames of a pair, in order. What this one was taken with.
  ExposureSettings add(const GroundBrightness& ground, const ExposureSettings& stated);
  std::size_t lag() const { return lag_; }

  static constexpr std::size_t kFrames = 24, kMostLag = 2;
  static constexpr int kReversals = 3;

 private:
  struct Frame {
    double median = 0;
    ExposureSettings stated;
    double product_us() const;
  };
  int reversals() const;
  double to_and_fro(std::size_t lag) const;

  std::deque<Frame> frames_;
  std::size_t lag_ = 0;
};

}  // namespace spartan::internal
