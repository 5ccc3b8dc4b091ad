// Errors of an estimated trajectory against the true one.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/core/pose.h"
#include "spartan/core/result.h"
#include "spartan/core/trajectory.h"

namespace spartan {

/// What is fitted before two trajectories are compared.
enum class Alignment {
  none,   ///< nothing
  first,  ///< the first pose of the estimate is moved onto the first pose of the truth
  yaw,    ///< translation and rotation about z (4 degrees of freedom, least squares)
  se3,    ///< translation and rotation (6, least squares)
  sim3,   ///< translation, rotation and scale (7, least squares)
};
std::string_view name_of(Alignment alignment);
std::optional<Alignment> alignment_named(std::string_view name);

/// The similarity that minimizes Σ |target_i − (s R source_i + t)|² (Umeyama 1991); s = 1 unless
/// `with_scale`. Where all points lie on a line or at one place, one of several optimal rotations is returned.
/// Throws std::invalid_argument where the counts differ or are 0.
Similarity fit_similarity(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target,
                          bool with_scale);

/// The rotation about z and the translation that minimize the same sum, in closed form.
/// Source: Zhang & Scaramuzza, "A tutorial on quantitative trajectory evaluation for visual(-inertial) odometry",
/// IROS 2018, section III-B.
Similarity fit_yaw(const std::vector<Eigen::Vector3d>& source, const std::vector<Eigen::Vector3d>& target);

/// truth_from_estimate of two trajectories whose poses correspond one to one.
Similarity align(const Trajectory& estimate, const Trajectory& truth, Alignment alignment);

struct ErrorStatistics {
  double rmse = 0, mean = 0, median = 0, max = 0;
};
/// Throws std::invalid_argument on an empty list.
ErrorStatistics statistics_of(std::vector<double> errors);

/// Mean errors over all segments of one length; std::nullopt without any segment.
struct SegmentErrors {
  double length_m = 0;
  int count = 0;
  std::optional<double> translation_percent;  ///< percent of the length
  std::optional<double> rotation_deg_per_m;
};

struct TrajectoryMetricsOptions {
  Alignment alignment = Alignment::se3;
  double max_dt_s = 0.02;  ///< maximum time difference of associated poses
  std::vector<double> segment_lengths_m{1, 2, 5, 10, 20, 40, 100};
  int segment_step = 1;      ///< frames between the starts of consecutive segments
  int rpe_delta_frames = 1;  ///< frames between the two poses of a relative pose error
};
/// The options with the segments of the KITTI odometry benchmark: 100, 200 … 800 m, starting at every 10th frame.
TrajectoryMetricsOptions with_kitti_segments(TrajectoryMetricsOptions options);

/// A metric that could not be computed, by its name in the JSON output, and the reason.
struct MissingMetric {
  std::string name;
  std::string reason;
};

struct TrajectoryMetrics {
  Alignment alignment = Alignment::none;
  Similarity truth_from_estimate;
  std::size_t frames = 0;    ///< number of associated poses
  double path_length_m = 0;  ///< of the polyline through the associated true positions
  ErrorStatistics ate_m;     ///< absolute trajectory error
  /// RMS position error with the first poses aligned: what has accumulated since the start.
  std::optional<double> ate_first_rmse_m;
  std::optional<double> drift_percent;  ///< error of the last position, percent of the path length
  std::optional<std::vector<SegmentErrors>> segments;
  int rpe_delta_frames = 1;
  std::optional<ErrorStatistics> rpe_translation_m;
  std::optional<ErrorStatistics> rpe_rotation_deg;
  /// Angle of the rotation between the body axes of both trajectories where they are not the same axes, e.g. x forward
  /// and z forward: of the motions over segments of a 20th of the path, above 20°, with at most 10 % of them not
  /// explained. RPE, segments and drift then compare different axes.
  std::optional<double> axes_rotation_deg;
  std::vector<MissingMetric> missing;
};

/// Compares two trajectories, poses as world_from_body of the same body frame. With P the aligned estimate and Q the
/// truth at the associated frames:
/// - ATE: |trans(P_i) − trans(Q_i)| (Sturm et al., IROS 2012, eq. 2, 3).
/// - RPE: E_i = (Q_i⁻¹ Q_{i+Δ})⁻¹ (P_i⁻¹ P_{i+Δ}) for every i (ibid. eq. 1): |trans(E_i)| and its rotation angle.
/// - Segments: the same E between frame i and the first frame at or beyond the length along the true path, divided
///   by the length (Geiger et al., CVPR 2012; their development kit ends one frame later where a frame lies exactly
///   at the length).
/// - Drift: |trans((Q_0⁻¹ Q_n)⁻¹ (P_0⁻¹ P_n))| / path length, with P the estimate before alignment. A percentage of
///   the noise of a truth at rest means nothing: missing where the truth stays within 0.5 m of its start.
/// Where all true rotations are the identity, the truth is taken to have positions only: RPE then compares the
/// displacements as vectors of the true world frame, and what needs rotations is listed in `missing`.
/// Fails with code `input` where no poses can be associated, and `usage` where the alignment `first` is requested for a
/// truth without rotation, or lengths or steps are not positive.
Result<TrajectoryMetrics> compare_trajectories(const Trajectory& estimate, const Trajectory& truth,
                                               const TrajectoryMetricsOptions& options);

}  // namespace spartan
