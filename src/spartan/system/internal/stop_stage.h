// Collects the views of a stop while the back end computes their disparities, and maps the stop after the rover left
// it.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/samples.h"
#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/stage_clock.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/stop_mapper.h"
#include "spartan/slam/map_merger.h"
#include "spartan/system/internal/back_end.h"
#include "spartan/system/internal/motion_chain.h"
#include "spartan/system/internal/stored_pair.h"

namespace spartan::internal {

/// What is known of a stop, or of a keyframe, when its map is applied: poses in the body frame at the odometry pair's
/// first frame there.
struct StopSurvey {
  std::int64_t position_id = -1;  ///< -1: a keyframe
  Stamp stamp;                    ///< of the odometry pair's first frame at the stop
  UncertainPose world_from_body;  ///< at that frame
  Stamp last_stamp;               ///< of the odometry pair's latest frame
  /// Body motion between the two frames: a halted rover may sink, or be rocked by its mast.
  UncertainPose first_from_last;
  int views = 0;
};

/// Frames of one stop share a position_id. A stop is mapped if another pair than that of the odometry has views of it,
/// even views before the odometry pair's first frame there. Every view is checked when it is added, so that the back
/// end can match it. A stop that the rover has left departs: the back end merges its views, then matches them with the
/// global map, and the oldest one is ready a stated number of frames later. The saved state contains the keys of the
/// views and the pose at the stops; the images must be passed in again after a resume.
class StopStage {
 public:
  StopStage(StopMapper mapper, int delay_frames) : mapper_(std::move(mapper)), delay_frames_(delay_frames) {}

  /// Adds a frame of the odometry pair, at a stop or between stops (position_id < 0); the first frame at a stop is one
  /// of its views. `world_from_body`: at this frame. `motion`: of the body, up to this frame. `nearest_m`: nearest
  /// depth of the search range. The stop before must have departed. Codes as add_view().
  Status add_odometry_frame(std::int64_t position_id, const RectifiedPair& frame, double nearest_m,
                            const UncertainPose& world_from_body, const RelativeMotion& motion, BackEnd& back_end);
  /// Adds a view by another pair. Views of a stop that the odometry pair never reaches are discarded. Code
  /// `frame_rejected` if the view cannot be matched (StopMapper::check); the state is then unchanged.
  Status add_view(std::int64_t position_id, const std::string& pair, const RectifiedPair& frame, double nearest_m,
                  BackEnd& back_end);

  /// Of the current stop; -1 between stops.
  std::int64_t position_id() const { return current() != nullptr ? current()->position_id : -1; }

  /// Whether there is a current stop with a view of another pair, so that it will be mapped.
  bool has_views() const { return current() != nullptr && !current()->views.empty(); }
  /// The rover leaves the current stop. Without a view of another pair the stop is discarded.
  void depart(BackEnd& back_end);
  /// The stop that has just departed is the current one again. Views that are added now are not mapped.
  void undo_departure() { stops_.back().departed = false; }

  bool has_departed() const { return oldest() != nullptr; }
  /// Number of stops that the rover has left and whose maps are not applied.
  int departed() const { return static_cast<int>(stops_.size()) - (current() != nullptr ? 1 : 0); }
  /// Whether the match of the oldest departed stop is still to be started.
  bool is_unmatched() const { return has_departed() && oldest()->match == nullptr; }
  /// The prior pose of the map of the oldest stop, departed or not.
  const Pose& prior() const { return stops_.front().world_from_body.pose; }
  /// `global`: what MapMerger::excerpt_around() found there, in `clock`.
  void start_match(const MapMerger& merger, std::optional<MapExcerpt> global, StageClock clock, BackEnd& back_end);
  /// Whether the map of the oldest departed stop is to be applied: after so many frames, or `early`.
  bool is_due(bool early) const {
    return has_departed() && oldest()->match != nullptr && (early || oldest()->age >= delay_frames_);
  }
  /// The job that makes it.
  BackEnd::Ticket ticket() const { return oldest()->ticket; }
  /// After that job.
  const MapMergeResult& matched() const { return *oldest()->match; }
  StopSurvey survey() const;
  /// Its map, and the times of the back end. The stop is discarded.
  struct Mapped {
    MapMergeResult matched;
    std::vector<StageTime> times;
    double seconds = 0;  ///< since the departure
  };
  Mapped take_oldest();

  /// After restore(): the frames whose images must be passed in again, in this order.
  std::vector<FrameKey> pending_frames(const std::string& odometry_pair) const;
  void restore_first_frame(const RectifiedPair& frame, double nearest_m);
  Status restore_view(const std::string& pair, const RectifiedPair& frame, double nearest_m, std::int64_t position_id,
                      BackEnd& back_end);
  /// Instead: the stops that they belong to are discarded.
  void abandon_pending_frames();

  void save(ArchiveWriter& out) const;
  void restore(ArchiveReader& in);

 private:
  // Made by jobs of the back end.
  struct Merged {
    std::vector<SurfacePoint> points;
    StageClock clock{CLOCK_THREAD_CPUTIME_ID};
  };
  struct Stop {
    std::int64_t position_id = -1;
    Stamp stamp;
    UncertainPose world_from_body;
    MotionChain chain;
    std::vector<FrameKey> views;    // added views of other pairs
    std::vector<FrameKey> pending;  // views to be added again after restore()
    bool first_frame_is_pending = false;
    std::optional<StoredPair> first_frame;  // of the odometry pair, until there is a view
    double first_frame_nearest_m = 0;
    bool departed = false;
    std::int32_t age = 0;                             // frames since then
    std::chrono::steady_clock::time_point departure;  // for reports only
    std::shared_ptr<Merged> merged = std::make_shared<Merged>();
    std::shared_ptr<MapMergeResult> match;  // null: not started
    BackEnd::Ticket ticket = 0;
  };
  // A view of a stop that the odometry pair has not reached yet.
  struct EarlyView {
    std::int64_t position_id = -1;
    FrameKey key;
    StoredPair images;
    double nearest_m = 0;
  };
  const Stop* oldest() const { return !stops_.empty() && stops_.front().departed ? &stops_.front() : nullptr; }
  const Stop* current() const { return !stops_.empty() && !stops_.back().departed ? &stops_.back() : nullptr; }
  Status begin_stop(std::int64_t position_id, const RectifiedPair& frame, double nearest_m,
                    const UncertainPose& world_from_body, const RelativeMotion& motion, BackEnd& back_end);
  void add_to(Stop& stop, const FrameKey& key, StoredPair images, double nearest_m, BackEnd& back_end);
  void compute(const Stop& stop, StoredPair images, double nearest_m, BackEnd& back_end);
  void merge(Stop& stop, BackEnd& back_end);

  StopMapper mapper_;  // used by the jobs alone
  int delay_frames_;
  std::deque<Stop> stops_;  // those that have departed, and the current one
  std::vector<EarlyView> early_;
  std::vector<FrameKey> pending_early_;  // to be added again after restore()
};

}  // namespace spartan::internal
