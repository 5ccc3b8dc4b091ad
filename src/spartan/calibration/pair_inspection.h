// Is this calibration good for these images? Matches the images of a stereo pair and checks its calibration.
#pragma once

#include <cstdint>
#include <functional>
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

}  // namespace spartan
