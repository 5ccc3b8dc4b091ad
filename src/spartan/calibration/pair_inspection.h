// Is this calibration good for these images? Matches the images of a stereo pair and checks its calibration.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "spartan/calibration/pair_check.h"
#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"

namespace spartan {

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
