// Imager: from raw stereo frames to rectified pairs (debayering → vignetting → contrast → rectification).
#pragma once

#include <memory>
#include <string>

#include "spartan/camera/samples.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/imaging_options.h"
#include "spartan/imaging/rectified_pair.h"
#include "spartan/rig/rig.h"

namespace spartan {

/// Converts stereo frames to rectified pairs. Holds one rectification table and image buffers per camera; its results
/// do not depend on earlier frames.
class Imager {
 public:
  /// Code `configuration` where options are out of bounds, a pair cannot be rectified (diverging optical axes, an
  /// impossible view, a camera that sees less than 1 % of the view), a self-mask cannot be read or a vignetting
  /// correction is out of range. `mask_folder` is the folder of the rig file, to which the names of self-masks are
  /// relative.
  static Result<Imager> create(const Rig& rig, const ImagingOptions& options, ThreadPool workers,
                               const std::string& mask_folder = {});
  Imager(Imager&&) noexcept;
  Imager& operator=(Imager&&) noexcept;
  ~Imager();

  /// The image views of the result are valid until the next call for the same pair. Code `frame_rejected` where the
  /// pair of the frame is unknown or an image has another size or pixel format than its camera in the rig. RGB images
  /// of a gray camera are converted to gray.
  Result<RectifiedPair> process(const StereoFrame& frame);

  /// Geometry of the rectified images of a pair. Throws where there is no such pair.
  RectifiedStereo geometry(const std::string& pair) const;

 private:
  struct State;
  explicit Imager(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan
