// How far an estimated trajectory is from the true one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spartan/core/result.h"
#include "spartan/core/trajectory.h"
#include "spartan/eval/alignment.h"

namespace spartan {

struct ErrorStatistics {
  double rmse = 0, mean = 0, median = 0, max = 0;
};
/// Of a list that is not empty.
ErrorStatistics statistics_of(std::vector<double> errors);

/// Mean errors over all segments of one length. Without any segment the means are not there.
struct SegmentErrors {
  double length_m = 0;
  int count = 0;
  std::optional<double> translation_percent;  ///< of the length
  std::optional<double> rotation_deg_per_m;
};

struct TrajectoryMetricsOptions {
  Alignment alignment = Alignment::se3;
  double max_dt_s = 0.02;
  std::vector<double> segment_lengths_m{1, 2, 5, 10, 20, 40, 100};
  int segment_step = 1;  ///< frames from one segment's start to the next one's
  int rpe_delta_frames = 1;
};
/// The lengths and steps of the KITTI odometry benchmark: 100, 200 … 800 m, from every 10th frame.
void use_kitti_segments(TrajectoryMetricsOptions& options);

/// A metric that could not be taken, by its name in the JSON, and why.
struct MissingMetric {
  std::string name;
  std::string reason;
};

struct TrajectoryMetrics {
  Alignment alignment = Alignment::none;
  Similarity truth_from_estimate;
  std::size_t frames = 0;    ///< associated poses
  double path_length_m = 0;  ///< of the polyline through the associated true positions
  ErrorStatistics ate_m;
  std::optional<double> drift_percent;
  std::optional<std::vector<SegmentErrors>> segments;
  int rpe_delta_frames = 1;
  std::optional<ErrorStatistics> rpe_translation_m;
  std::optional<ErrorStatistics> rpe_rotation_deg;
  std::vector<MissingMetric> missing;
};

/// Compares two trajectories, poses as world_from_body of the same body frame. With P the aligned estimate and Q the
/// truth at the associated frames:
/// - ATE: |trans(P_i) − trans(Q_i)| (Sturm et al., IROS 2012, eq. 2, 3).
/// - RPE: E_i = (Q_i⁻¹ Q_{i+Δ})⁻¹ (P_i⁻¹ P_{i+Δ}) for every i (ibid. eq. 1): |trans(E_i)| and its rotation angle.
/// - Segments: the same E between frame i and the first frame at or beyond the length along the true path, divided
///   by the length (Geiger et al., CVPR 2012; their own program ends one frame later where a frame lies exactly at
///   the length).
/// - Drift: |trans(Q_0⁻¹ Q_n) − trans(P_0⁻¹ P_n)| / path length of the estimate as it came, without scale.
/// Where all true rotations are the identity, the truth is taken to know positions only: RPE then compares the
/// displacements as vectors of the true world, and rotation, segments and drift are missing with the reason.
/// Errors: `input` where nothing can be associated, `usage` where the first pose shall be aligned to a truth
/// without rotation, or where lengths or steps are not positive.
Result<TrajectoryMetrics> compare_trajectories(const Trajectory& estimate, const Trajectory& truth,
                                               const TrajectoryMetricsOptions& options);

}  // namespace spartan
