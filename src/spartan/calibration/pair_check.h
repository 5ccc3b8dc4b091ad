// Checks the calibration of stereo pairs by their images, or by matches between them, and corrects it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/rig/describe.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// The same point in both images, unrectified, pixels.
struct PixelMatch {
  Eigen::Vector2d left, right;
};

/// A small correction of a stereo calibration. The rotation is that of the right camera about its own axes,
/// left_from_right' = left_from_right · Ry(yaw) Rx(pitch) Rz(roll), positive to the right, up and clockwise as in
/// `describe_relative_pose`. `baseline_down_rad` and `baseline_ahead_rad` rotate the direction of the baseline.
struct PairCorrection {
  double pitch_rad = 0, yaw_rad = 0, roll_rad = 0;
  double baseline_down_rad = 0, baseline_ahead_rad = 0;
  double focal_ratio = 1;  ///< factor on the focal length of the right camera
  /// Radial distortion that a pinhole model lacks, k of r → r/(1 + k r²), which undistorts its rays; k is close to
  /// Brown's k1. 0 where it is not estimated.
  double left_radial = 0, right_radial = 0;
};

/// Row errors (left − right) of matches, pixels.
struct RowErrors {
  double mean_px = 0, p95_px = 0;  ///< of the absolute values
  double median_px = 0;            ///< signed
};

/// A cell of the left image.
struct RowErrorCell {
  Eigen::Vector2d centre_px;
  int matches = 0;
  double median_px = 0;  ///< signed row error in the rectified view of the pair as given
};

/// The quality of a calibration as its images show it.
enum class PairGrade {
  good,    ///< row errors have a mean of at most 0.5 px and a 95th percentile of at most 1.5 px; no findings
  usable,  ///< at most 1 px and 3 px: stereo works with fewer matches; or only findings that leave the ranges correct
  bad,     ///< a finding makes ranges or rows wrong, or the images do not suffice for a check
};
std::string_view name_of(PairGrade grade);

/// The result of a check. Row errors are signed left − right, in pixels.
struct PairCheck {
  int matches = 0, inliers = 0;  ///< inliers agree with the corrected pair
  /// Row errors of the inliers: in the unrectified images; rectified with the calibration as given (swapped cameras,
  /// inverse transform and image size corrected, for without that no row is meaningful); rectified with the rig
  /// `corrected`. NaN where the matches do not suffice.
  RowErrors unrectified_rows, nominal_rows, corrected_rows;
  std::vector<RowErrorCell> map;     ///< 8 x 6 cells over the left image, those with at least 3 matches
  PairCorrection correction, sigma;  ///< sigma of yaw includes a lens decentering that imitates it (0.3°); NaN as above
  double yaw_sigma_px = 0;  ///< sigma of yaw as a disparity error, px: the uncertainty that rows leave in range
  std::vector<RigFinding> findings;
  PairGrade grade = PairGrade::bad;
  std::vector<PixelMatch> inlier_matches;  ///< the inliers, unrectified
  std::vector<double> row_error_px;        ///< of each inlier, rectified with the calibration as given
  double inlier_limit_px = 0;              ///< largest corrected row error of an inlier
  bool images_swapped = false;   ///< the first image is of the right camera; `matched` and `corrected` account for it
  bool has_gross_error = false;  ///< cameras, transform or image size are wrong: the rig as given cannot be rectified
  /// The rig with the findings corrected: swapped cameras, transform, unit, image sizes, distortion; pitch and roll;
  /// and yaw, focal ratio and baseline direction where the images require it. Without findings the rig as given; none
  /// where no hypothesis explains the images.
  std::optional<Rig> corrected;
};

/// Checks a pair by matches of one or more stereo frames, a share of which may be wrong. `image_size`: size of the
/// images they come from. Method: docs/math/pair_check.md. Findings, beside those of plausibility_findings() that the
/// images do not refute:
/// - `inverse_transform`, `swapped_eyes`, `size_mismatch`, `distortion_ignored`: gross errors (hypothesis search);
/// - `row_offset`: median row error above 0.5 px;
/// - `roll_offset`: roll of more than 0.5 px over half the image width;
/// - `row_residuals`: rows worse than those of a good pair, without another finding;
/// - `yaw_offset`: yaw beyond 2.6 standard deviations, or one that explains negative disparities. Rows observe yaw only
///   by the pattern x y, which lens decentering imitates;
/// - `focal_ratio`: focal lengths inconsistent by more than 0.3 %;
/// - `not_enough_texture`: fewer than 40 inliers, or inliers in fewer than a quarter of the image cells;
/// - `identical_images`: both images are the same;
/// - `not_explained`: no hypothesis makes the rows agree: images of different times, places or rigs.
PairCheck check_pair(const Rig& rig, const StereoPair& pair, const std::vector<PixelMatch>& matches,
                     ImageSize image_size);

/// The same for images without a calibration, with guessed_rig(). Yaw, focal ratio and distortion are corrected but not
/// reported as findings, for they refer to the guess.
PairCheck check_images(const std::vector<PixelMatch>& matches, ImageSize image_size);

/// A rig for images without a calibration: two equal pinholes with a focal length of 1.2 times the larger image side,
/// parallel, 1 m apart. Results for rows, pitch and roll hold for any focal length close to it.
Rig guessed_rig(ImageSize image_size);

/// The rig as corrected for one pair (PairCheck::corrected).
struct CorrectedPair {
  std::string pair;
  Rig rig;
};

struct MergedRig {
  Rig rig;
  std::vector<std::string> discarded;  ///< pairs whose correction contradicts that of an earlier pair
};

/// Applies the correction of every pair to the rig, in the given order. The images of a pair determine the pose of its
/// cameras relative to each other only. A camera shared by two pairs therefore keeps the pose that the first pair gave
/// it, and the other camera of the second pair moves instead. A correction is discarded where that is impossible: both
/// cameras belong to earlier pairs, or the shared camera's intrinsics would change again. All rigs have the cameras and
/// pairs of `given`.
MergedRig merge_corrections(const Rig& given, const std::vector<CorrectedPair>& pairs);

/// The images of one stereo frame, 8-bit gray, unrectified. Borrowed.
struct StereoViews {
  ImageView<const std::uint8_t> left, right;
};

/// The check of a pair, and the matches it rests on.
struct PairInspection {
  PairCheck check;
  std::vector<std::vector<PixelMatch>> matches;  ///< of each frame

  /// Whether the images were sufficient: enough matches, cameras side by side, two different images.
  bool sufficient() const;
};

/// Called with the number of frames that are matched.
using InspectionProgress = std::function<void(std::size_t)>;

/// Matches the features of one or more frames of a pair (match_views()) and checks the calibration by all matches
/// (check_pair()). More frames of different scenes give smaller standard deviations; 12 are plenty. Code `usage` if the
/// rig has no such pair, if there is no frame, or if the images are not all of one size. The result is the same for any
/// number of threads.
Result<PairInspection> inspect_pair(const Rig& rig, const StereoPair& pair, std::span<const StereoViews> frames,
                                    const ThreadPool& workers, const InspectionProgress& progress = {});

/// The same for images without a calibration (check_images()): rows, pitch and roll of two cameras side by side.
Result<PairInspection> inspect_images(std::span<const StereoViews> frames, const ThreadPool& workers,
                                      const InspectionProgress& progress = {});

/// What a rotation of the right camera does to the rows of a pair.
struct RowAlignment {
  int matches = 0, inliers = 0;
  double pitch_rad = 0, roll_rad = 0;  ///< the rotation, as in PairCorrection
  RowErrors given, aligned;            ///< of the inliers, rectified by the rig as given and as aligned
  std::optional<Rig> rig;              ///< the rig with that rotation; none where it is not needed or not certain
};

/// Estimates pitch and roll of the right camera from the rows of matches (match_views()), and nothing else: rows
/// observe yaw, focal length and baseline direction weakly, and errors of these cost range accuracy. The rotation is
/// needed where it moves rows by more than 0.3 px, which costs dense stereo matches on fine texture. It is certain
/// where at least 40 inliers in a quarter of the cells of the image agree with it to 0.5 px, it reduces their mean row
/// error by a quarter, and it is below 2°. Codes as inspect_pair().
Result<RowAlignment> align_rows(const Rig& rig, const StereoPair& pair, std::span<const StereoViews> frames,
                                const ThreadPool& workers);

}  // namespace spartan
