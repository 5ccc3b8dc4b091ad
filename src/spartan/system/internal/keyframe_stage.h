// Local maps from keyframes of the odometry pair, for a rover that does not halt and look around.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "spartan/system/internal/motion_chain.h"
#include "spartan/system/internal/stop_stage.h"
#include "spartan/system/internal/stored_pair.h"
#include "spartan/system/run_options.h"

namespace spartan::internal {

/// The sector of level ground that a camera sees: seen from above, within `range_m` of the camera and within
/// `half_angle_rad` of its optical axis.
struct GroundSector {
  Eigen::Vector2d camera_m = Eigen::Vector2d::Zero();
  double heading_rad = 0;  ///< of the optical axis, counter-clockwise from x
  double half_angle_rad = 0;
  double range_m = 0;

  bool contains(const Eigen::Vector2d& point_m) const;
};

/// A camera that looks straight down has the whole disc around it. `world_from_left`: optical frame, z of the world up.
GroundSector ground_sector(const RectifiedStereo& geometry, const Pose& world_from_left, double range_m);

/// Fraction of the area of `now` that lies outside of `before`, by 8 × 9 samples.
double new_ground(const GroundSector& now, const GroundSector& before);

/// Chooses keyframes and reconstructs the ground that each sees. A keyframe is pending until its map is in the global
/// map, a stated number of frames later. The state contains its key; its images must be passed in again after a resume.
class KeyframeStage {
 public:
  /// `side_m`: side of the local maps.
  KeyframeStage(StopMapper mapper, const KeyframeOptions& options, double side_m)
      : mapper_(std::move(mapper)), options_(options), side_m_(side_m) {}

  /// Whether a frame at `world_from_left` (by the odometry alone) should become a keyframe: distance, rotation or new
  /// ground since the last one reach their limits. The first frame is one.
  bool is_due(const RectifiedPair& frame, const Pose& world_from_left) const;

  /// Makes the frame a keyframe; none may be pending. `world_from_body`: prior pose of its map; `motion`: of the body,
  /// up to the frame. The frame must be one that StopMapper::check() accepts.
  void begin(const RectifiedPair& frame, const Pose& world_from_left, const UncertainPose& world_from_body,
             const RelativeMotion& motion);
  /// Lets the pending keyframe be ready at the next frame: another one is due.
  void hurry() { age_ = options_.delay_frames; }
  /// Each frame after it; `motion`: of the body, up to the frame.
  void advance(const RelativeMotion& motion);

  /// Whether a map is to be made of the last keyframe.
  bool is_pending() const { return pending_ && frame_; }
  /// Whether it is to be in the global map now.
  bool is_ready() const { return is_pending() && age_ >= options_.delay_frames; }

  /// The surface seen by the pending keyframe, in its body frame. Uses nothing that advance() or save() change or read,
  /// so it may run beside them. Codes as StopMapper::check().
  Result<std::vector<SurfacePoint>> points(double nearest_m);
  /// The pending keyframe up to the current frame, without its points.
  StopSurvey survey() const;
  const UncertainPose& prior() const { return world_from_body_; }
  Stamp stamp() const { return stamp_; }
  void clear();

  /// After restore(): the stamp of the pending keyframe, to be passed to restore_frame().
  std::optional<Stamp> pending_frame() const;
  void restore_frame(const RectifiedPair& frame) { frame_.emplace(frame); }

  void save(ArchiveWriter& out) const;
  void restore(ArchiveReader& in);

 private:
  StopMapper mapper_;
  KeyframeOptions options_;
  double side_m_;
  bool any_ = false, pending_ = false;  // whether there was a keyframe; whether its map is still to be made
  Pose world_from_left_;                // of the last keyframe
  std::int32_t age_ = 0;                // frames since the pending keyframe
  Stamp stamp_;
  UncertainPose world_from_body_;
  MotionChain chain_;
  std::optional<StoredPair> frame_;
};

}  // namespace spartan::internal
