// The rover position at hand: its shots are gathered until the rover goes on, then they become a map.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "spartan/camera/frame_source.h"
#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/rectified_pair.h"
#include "spartan/reconstruction/stop_mapper.h"

namespace spartan {

/// What was seen from one position, in the body frame at the first shot there.
struct PositionSurvey {
  std::int64_t position_id = -1;
  Stamp stamp;                  ///< of the odometry's first shot there
  UncertainPose standing;       ///< world_from_body at that shot
  Stamp last_stamp;             ///< of the odometry's last shot there
  UncertainPose since_arrival;  ///< first_from_last: a rover that stands may sink, or be rocked by its mast
  int views = 0;
  MergedRange merged;
  std::vector<SurfacePoint> points;
};

/// Shots of one position share a position_id. The pair that drives the odometry sees every position; a position is
/// mapped where other pairs look too, be it before the odometry's first shot there. The stage's memory are the names of
/// its views and the pose there: the views are looked at again after a resume. A view is checked when it comes, so that
/// what is kept of it can be matched whenever that is due.
class PositionStage {
 public:
  PositionStage(const DisparityOptions& disparity, const MappingOptions& options, ThreadPool workers)
      : mapper_(disparity, options, std::move(workers)) {}

  /// A shot of the odometry's pair, wherever it is: the first one at a position is a view of it. `standing`: the body
  /// at the shot; `moved`: previous_from_current of the body since the shot before. Codes as look().
  Status pass(std::int64_t position_id, const RectifiedPair& shot, double nearest_m, const UncertainPose& standing,
              const UncertainPose& moved);
  /// A view by the pair of that name. One of a position that the odometry passes by is left out. Code `frame_rejected`
  /// where the view cannot be matched (StopMapper::check): nothing has changed then.
  Status look(std::int64_t position_id, const std::string& pair, const RectifiedPair& shot, double nearest_m);

  std::int64_t position_id() const { return position_id_; }

  /// After restore(): the stamp of the odometry's first shot, and the looks, each to be handed in again.
  std::optional<Stamp> wanted_arrival() const;
  const std::vector<FrameKey>& wanted_looks() const { return wanted_; }
  void recall_arrival(const RectifiedPair& shot, double nearest_m);

  /// The position as it was seen, where other pairs looked. It stays the position at hand until leave().
  std::optional<PositionSurvey> survey();
  /// Nothing is kept of the position.
  void leave();

  StopMapper& mapper() { return mapper_; }

  void save(ArchiveWriter& out) const;
  void restore(ArchiveReader& in);

 private:
  // A copy of a pair whose buffers belong to somebody else.
  struct KeptShot {
    explicit KeptShot(const RectifiedPair& shot);
    RectifiedPair view() const;
    RectifiedPair pair;
    Image<std::uint8_t> left, right, left_mask, right_mask;
  };
  struct EarlyLook {
    std::int64_t position_id = -1;
    FrameKey name;
    KeptShot shot;
    double nearest_m = 0;
  };
  Status arrive(std::int64_t position_id, const RectifiedPair& shot, double nearest_m, const UncertainPose& standing);
  Status add(const RectifiedPair& shot, double nearest_m);

  StopMapper mapper_;
  std::int64_t position_id_ = -1;
  Stamp stamp_, last_stamp_;
  UncertainPose standing_, since_arrival_;
  std::vector<FrameKey> looks_, wanted_;
  std::vector<EarlyLook> early_;  // of a position that is still to come
  std::optional<KeptShot> kept_;
  double kept_nearest_m_ = 0;
};

}  // namespace spartan
