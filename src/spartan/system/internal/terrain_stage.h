// Disparity images of single frames of the odometry pair, every few metres.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "spartan/core/archive.h"
#include "spartan/core/pose.h"
#include "spartan/core/stage_clock.h"
#include "spartan/imaging/imager.h"
#include "spartan/reconstruction/disparity_computer.h"
#include "spartan/system/internal/back_end.h"
#include "spartan/system/internal/stored_pair.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run_options.h"

namespace spartan::internal {

/// The back end computes one view at a time; it is delivered a stated number of frames after its own. The saved state
/// contains the key of the pending view, whose images must be passed in again after a resume.
class TerrainStage {
 public:
  explicit TerrainStage(const TerrainOptions& options) : options_(options) {}

  /// Whether the frame at which the path is `distance_m` long should be a view.
  bool is_due(double distance_m) const { return last_m_ < 0 || distance_m - last_m_ >= options_.every_m; }

  /// Makes the frame a view; none may be pending. The computer is used by the job alone. `nearest_m`: nearest depth of
  /// the search range.
  void begin(const RectifiedPair& frame, const Pose& world_from_left, double distance_m, double nearest_m,
             DisparityComputer& computer, BackEnd& back_end);
  /// The same with disparities that there are already.
  void begin(const RectifiedPair& frame, const Pose& world_from_left, double distance_m, const DisparityImage& known);
  /// Each frame after it.
  void advance() { age_ += age_ < options_.delay_frames ? 1 : 0; }

  bool is_pending() const { return pending_; }
  /// Whether it is to be delivered now.
  bool is_ready() const { return pending_ && age_ >= options_.delay_frames; }
  BackEnd::Ticket ticket() const { return ticket_; }
  /// After that job.
  TerrainView take(StageClock& clock);

  /// After restore(): the stamp of the pending view, to be passed to restore_frame().
  std::optional<Stamp> pending_frame() const { return pending_ && !job_ ? std::optional(stamp_) : std::nullopt; }
  void restore_frame(const RectifiedPair& frame, double nearest_m, DisparityComputer& computer, BackEnd& back_end);
  /// Instead: no view is made.
  void abandon_frame() { pending_ = false; }

  void save(ArchiveWriter& out) const;
  void restore(ArchiveReader& in);

 private:
  struct Job {
    TerrainView view;
    StageClock clock{CLOCK_THREAD_CPUTIME_ID};
  };
  void mark(const RectifiedPair& frame, const Pose& world_from_left, double distance_m);
  void compute(const RectifiedPair& frame, double nearest_m, DisparityComputer& computer, BackEnd& back_end);

  TerrainOptions options_;
  double last_m_ = -1;  // path length at the last view
  bool pending_ = false;
  std::int32_t age_ = 0;  // frames since the pending view
  Stamp stamp_;
  Pose world_from_left_;
  std::shared_ptr<Job> job_;
  BackEnd::Ticket ticket_ = 0;
};

}  // namespace spartan::internal
