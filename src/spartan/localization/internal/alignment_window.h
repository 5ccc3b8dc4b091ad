// The last visual motions and IMU readings of a filter whose IMU is not aligned, or was excluded.
#pragma once

#include <optional>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/time.h"
#include "spartan/localization/internal/inertial_alignment.h"
#include "spartan/localization/localizer.h"

namespace spartan::internal {

/// Cuts the IMU's readings at the frames, which lie between them: a segment is complete once the reading after its
/// frame is known. No allocation while no motions are added.
class AlignmentWindow {
 public:
  /// Discards all segments; the next one begins at this frame.
  void begin(Stamp frame);
  /// The visual motion since the frame before. One that begins elsewhere, or one that was lost, begins anew.
  void add(const RelativeMotion& motion);
  /// The next reading and the one before. A gap of more than `timeout_s` begins anew at the next frame. Returns whether
  /// a segment was completed.
  bool add(const ImuSample& before, const ImuSample& sample, const InertialNoise& noise, double timeout_s);

  /// Biases, velocity and up at the newest frame with a complete segment.
  std::optional<InertialAlignment> align(const AlignmentPrior& prior) const;
  /// Length of the segments, s.
  double seconds() const;
  /// Whether each new segment replaces the oldest.
  bool is_full() const;

  /// The state, for the archive of the filter.
  struct Frame {
    Stamp stamp;
    AlignmentSegment segment;  ///< from the frame before; its inertial part is not yet known
  };
  struct State {
    bool open = false;       ///< `current` has begun
    Stamp begin, newest;     ///< frames: begin of `current`, and the last one added
    Preintegration current;  ///< since `begin`
    std::vector<AlignmentSegment> segments;
    std::vector<Frame> frames;  ///< later than `begin`, up to the next reading
  };
  const State& state() const { return state_; }
  State& state() { return state_; }

 private:
  void integrate(const ImuSample& from, const ImuSample& to, const InertialNoise& noise);
  void complete(const Frame& frame);

  State state_;
};

/// The reading at a time between two samples, by linear interpolation.
ImuSample interpolate(const ImuSample& a, const ImuSample& b, Stamp at);

}  // namespace spartan::internal
