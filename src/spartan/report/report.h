// The report page of a run, the comparison of trajectories behind it, and figures of rigs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "spartan/calibration/pair_check.h"
#include "spartan/camera/recording.h"
#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/core/time.h"
#include "spartan/core/trajectory.h"
#include "spartan/rig_design/rig_designer.h"
#include "spartan/system/map_files.h"
#include "spartan/system/run_options.h"
#include "spartan/system/run_store.h"

namespace spartan {

/// What a report page shows.
struct ReportRequest {
  std::string run;           ///< run folder
  std::string recording;     ///< the recording it was made from
  OpenOptions open;          ///< how the recording was opened
  RunOptions options;        ///< options of the run
  std::string truth;         ///< truth for find_trajectories(); empty: that of the recording, if any
  bool whole_truth = false;  ///< also show disparity errors and the true elevation of a simulation
  int threads = 1;
  std::string command_line, date;  ///< shown on the page; may be empty
  std::string page;                ///< where the page will be written, for links to the files of the run; empty: none
};

/// The report of a run as one HTML page that loads nothing: images, trajectories, disparities, maps, sensors, errors
/// where the truth is known, times, and links to the files of the run. Codes: `input`, `store_damaged`, `configuration`
/// as those who read run and recording.
Result<std::string> make_report(ReportRequest request);

/// The records of frames as columns of JSON, for plots: an object with an array for each quantity, null where it is not
/// known, of the frames from number `from` on, and `total`, the number of the frame behind the last one:
///   t_s since the first frame, stamp_ns (text), status, message; inliers, matches, landmarks, rms_px; latency_ms;
///   pose [x, y, z, qx, qy, qz, qw] of the best trajectory, sigma_m (along x, y, z of the world), ellipse_m2
///   (covariance xx, xy, yy of the position); odometry, slam, localization, smoothed: [x, y, z]; stages: {name: [ms]};
///   sensors: {name: [state]}; innovations: {name: [normalized innovation squared over its gate]}: above 1 the
///   measurement contradicts its prediction.
class FrameColumns {
 public:
  /// Of a run that began at `start`.
  FrameColumns(std::size_t from, Stamp start);
  FrameColumns(FrameColumns&&) noexcept;
  FrameColumns& operator=(FrameColumns&&) noexcept;
  ~FrameColumns();

  /// The next frame.
  void add(const FrameRecord& frame);
  /// After the last frame.
  std::string json();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The global map as a few arrays, for drawing in a browser: a JSON header with the layers and their places, padded to
/// a multiple of four bytes, behind its length (4 bytes, little endian); then the layers `elevation_m`, `sigma_m`,
/// `cost` (float32, NaN unknown), `class` (bytes, as in map files) and `colour` (three bytes a cell, of the images), in
/// rows from the north. Maps of more cells are thinned to every second, third … row and column; beyond
/// GlobalMap::kMostCells they are those of GlobalMap::overview(). Codes: those of GlobalMap::view().
Result<std::string> map_layers(SavedMap& saved, std::int64_t most_cells);

/// The two trajectories of a comparison.
struct ComparedTrajectories {
  Trajectory estimate, truth;             ///< poses of the same frame, in the convention of the truth
  std::string estimate_path, truth_path;  ///< the files that were read
  std::string kind;                       ///< "localization", "slam", "odometry", or "file"
};

/// `estimate`: a run folder, of which the trajectory `kind` is taken (empty: the best there is), or a trajectory file.
/// `truth`: a trajectory file or a recording with truth. Poses of a run are converted to the convention that its
/// rig.yaml states. Where only one side has time stamps and both have a pose for every frame (KITTI), the other one
/// takes them over line by line. Codes: `input` for what is missing or unreadable, `usage` for a kind requested of a
/// plain file, `configuration` for a run whose rig is invalid.
Result<ComparedTrajectories> find_trajectories(const std::string& estimate, const std::string& truth,
                                               const std::string& kind);

/// Normalized estimation error squared (NEES), eᵀ Σ⁻¹ e with e = Log(truth⁻¹ estimate), of motions with six degrees of
/// freedom: 6 on average where the covariance Σ is right, more where it is too small (Bar-Shalom, Li, Kirubarajan,
/// "Estimation with Applications to Tracking and Navigation", 2001, section 5.4).
struct NormalizedErrors {
  double length_m = 0;
  int count = 0;
  std::optional<double> mean, median;  ///< none if count is 0
};

struct MotionConsistency {
  NormalizedErrors motions;                ///< of the odometry between frames, with their own covariances
  std::vector<NormalizedErrors> segments;  ///< of the products of motions, with the covariance of DeadReckoning
};

/// The consistency of the odometry of a run folder with the truth, poses in the convention of the recording. Segments
/// contain no lost frame that no later motion spans; they end at the first frame at or beyond their length along the
/// true path. Codes: `input` for a run without frames, or of cameras on a pan-tilt unit; those of RunStore,
/// read_rig_yaml() and load_options().
Result<MotionConsistency> motion_consistency(const std::string& run, const Trajectory& truth, double max_dt_s,
                                             std::vector<double> lengths_m);

/// The file of a truth that is a recording or a file, read to see that it can be: the same errors before a long run.
Result<std::string> load_truth(const std::string& path);

/// The ground that the pairs of a rig design see: side view, and plan with the pans.
struct GroundFigure {
  std::string svg;
  Image<Rgb8> image;
};
/// Of the selected pairs (PairDesign::selected); none where the pair with pans (the first one without pans) has no
/// selection.
std::optional<GroundFigure> draw_ground(const RigRequirements& requirements, const RigDesign& design);

/// The row errors of a pair before and after correction: both images of one frame side by side, in three strips from
/// top to bottom: unrectified, rectified with the given rig (only a heading if that is impossible), rectified with the
/// corrected rig (omitted if there is none). Lines mark common rows. An arrow at each match points from the left row to
/// the right row, enlarged 10 times; gray circles are outliers. `matches` are in pixels of the given images. Each image
/// is reduced to at most 640 px in width.
Result<Image<Rgb8>> draw_pair_check(const Rig& rig, const StereoPair& pair, const PairCheck& check,
                                    ImageView<const std::uint8_t> left, ImageView<const std::uint8_t> right,
                                    const std::vector<PixelMatch>& matches, const ThreadPool& workers);

}  // namespace spartan
