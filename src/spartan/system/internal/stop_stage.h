// Collects the views of the current stop until the rover leaves it; then they are merged and mapped.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "spartan/system/internal/motion_chain.h"
#include "spartan/system/internal/stored_pair.h"

namespace spartan::internal {

/// Merged views of one stop, in the body frame at the odometry pair's first frame there; or the view of a keyframe.
struct StopSurvey {
  std::int64_t position_id = -1;  ///< -1: a keyframe
  Stamp stamp;                    ///< of the odometry pair's first frame at the stop
  UncertainPose world_from_body;  ///< at that frame
  Stamp last_stamp;               ///< of the odometry pair's last frame at the stop
  /// Body motion between the two frames: a halted rover may sink, or be rocked by its mast.
  UncertainPose first_from_last;
  int views = 0;
  std::vector<SurfacePoint> points;
};

/// Frames of one stop share a position_id. A stop is mapped if another pair than that of the odometry has views of it,
/// even views before the odometry pair's first frame there. The saved state contains the keys of the views and the pose
/// at the stop; the images must be passed in again after a resume. Every view is checked when it is added, so that all
/// stored views can be matched later.
class StopStage {
 public:
  explicit StopStage(StopMapper mapper) : mapper_(std::move(mapper)) {}

  /// Adds a frame of the odometry pair, at a stop or between stops (position_id < 0); the first frame at a stop is one
  /// of its views. `world_from_body`: at this frame. `motion`: of the body, up to this frame. `nearest_m`: nearest
  /// depth of the search range. Codes as add_view().
  Status add_odometry_frame(std::int64_t position_id, const RectifiedPair& frame, double nearest_m,
                            const UncertainPose& world_from_body, const RelativeMotion& motion);
  /// Adds a view by another pair. Views of a stop that the odometry pair never reaches are discarded. Code
  /// `frame_rejected` if the view cannot be matched (StopMapper::check); the state is then unchanged.
  Status add_view(std::int64_t position_id, const std::string& pair, const RectifiedPair& frame, double nearest_m);

  std::int64_t position_id() const { return position_id_; }

  /// After restore(): the stamp of the odometry pair's first frame at the stop, to be passed to restore_first_frame(),
  /// and the keys of the other views, to be passed to add_view() again.
  std::optional<Stamp> pending_first_frame() const;
  const std::vector<FrameKey>& pending_views() const { return pending_; }
  void restore_first_frame(const RectifiedPair& frame, double nearest_m);

  /// The merged views of the current stop; none without a view of another pair. The stop stays the current one until
  /// clear().
  std::optional<StopSurvey> survey();
  /// Discards the current stop.
  void clear();

  StopMapper& mapper() { return mapper_; }

  void save(ArchiveWriter& out) const;
  void restore(ArchiveReader& in);

 private:
  // A view of a stop that the odometry pair has not reached yet.
  struct EarlyView {
    std::int64_t position_id = -1;
    FrameKey key;
    StoredPair images;
    double nearest_m = 0;
  };
  Status begin_stop(std::int64_t position_id, const RectifiedPair& frame, double nearest_m,
                    const UncertainPose& world_from_body, const RelativeMotion& motion);
  Status add_to_mapper(const RectifiedPair& frame, double nearest_m);

  StopMapper mapper_;
  std::int64_t position_id_ = -1;
  Stamp stamp_;
  UncertainPose world_from_body_;
  MotionChain chain_;
  std::vector<FrameKey> views_;    // added views of other pairs
  std::vector<FrameKey> pending_;  // views to be added again after restore()
  std::vector<EarlyView> early_;
  std::optional<StoredPair> first_frame_;  // of the odometry pair at this stop
  double first_frame_nearest_m_ = 0;
};

}  // namespace spartan::internal
