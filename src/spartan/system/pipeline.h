// The whole system as one object that samples are pushed into.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/rectified_pair.h"
#include "spartan/odometry/odometer.h"
#include "spartan/rig/rig.h"
#include "spartan/system/run_options.h"
#include "spartan/system/stage_clock.h"

namespace spartan {

/// The ground as seen from one place. The views borrow the pipeline's buffers until the next frame.
struct TerrainView {
  RectifiedPair pair;
  ImageView<const float> disparity;  ///< px, NaN unknown
  Pose world_from_left;              ///< rectified left optical frame
};

/// What one stereo shot told.
struct FrameResult {
  std::int64_t frame_id = 0;
  std::string pair;
  Stamp stamp;
  UncertainPose world_from_body;  ///< covariance grows from zero at the first frame
  MotionEstimate motion;
  std::optional<TerrainView> terrain;  ///< where one was due
  std::vector<StageTime> times;
};

/// Samples in, poses and terrain out. Used by `spartan run` over a recording; a live camera or a ROS node pushes in
/// the same way, over memory it owns. Not thread-safe; one pipeline per rover.
class Pipeline {
 public:
  /// Codes: `configuration` (rig or options that do not fit).
  /// Self-masks are looked up in `mask_folder` (where the rig file lies).
  static Result<Pipeline> create(const Rig& rig, const RunOptions& options, Workers workers,
                                 const std::string& mask_folder = {});
  Pipeline(Pipeline&&) noexcept;
  Pipeline& operator=(Pipeline&&) noexcept;
  ~Pipeline();

  /// IMU samples that come before the first frame find the direction of gravity.
  void add(const ImuSample& sample);
  // Taken and not used yet: the localization module will.
  void add(const WheelSample& sample);
  void add(const CompassSample& sample);
  void add(const InclinometerSample& sample);

  /// One shot. Shots of pairs that do not drive the odometry give nothing. Code `input` where the images do not fit the
  /// rig, or it has no such pair: the frame is then left out and the pipeline goes on with the next.
  Result<std::optional<FrameResult>> add(const StereoFrame& frame);

  /// world_from_body at a moment without a pose: the last pose, moved on with the last motion's velocity.
  std::optional<Pose> predict(Stamp stamp) const;

  /// Whether gravity was measured (an IMU at rest before the first frame) or assumed along the start attitude.
  bool gravity_measured() const;

  /// The pair that drives the odometry.
  const std::string& odometry_pair() const;

  /// All stages' memory as a versioned value.
  Bytes save() const;
  Status restore(const Bytes& state);

 private:
  struct State;
  explicit Pipeline(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan
