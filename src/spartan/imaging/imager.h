// The imaging stage: debayering → vignetting → contrast → rectification.
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

/// Turns shots into rectified pairs. Holds one lookup table per eye and its image buffers; has no memory from
/// frame to frame.
class Imager {
 public:
  /// Code `configuration` where options are out of their bounds, a pair cannot be rectified (eyes that look apart, no
  /// view as asked for, an eye that sees less than 1 % of it), a self-mask cannot be read or a vignetting leaves no
  /// light. `mask_folder`: the rig file's folder, which the names of self-masks are relative to.
  static Result<Imager> create(const Rig& rig, const ImagingOptions& options, Workers workers,
                               const std::string& mask_folder = {});
  Imager(Imager&&) noexcept;
  Imager& operator=(Imager&&) noexcept;
  ~Imager();

  /// The views in the result are valid until the next call for the same pair. Code `input` where the frame's pair
  /// is unknown or its images have another size or format than the rig says. RGB images of a gray camera become gray.
  Result<RectifiedPair> process(const StereoFrame& frame);

  /// Geometry of a pair's rectified view. Throws on an unknown name.
  RectifiedStereo geometry(const std::string& pair) const;

 private:
  struct State;
  explicit Imager(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan
