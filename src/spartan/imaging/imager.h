// The imaging stage: debayering → contrast → rectification.
#pragma once

#include <memory>
#include <string>

#include "spartan/camera/samples.h"
#include "spartan/core/options.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/imaging/rectified_pair.h"
#include "spartan/rig/rig.h"

namespace spartan {

struct ImagingOptions {
  std::string debayer = "bilinear";
  bool contrast = true;
  double contrast_low_percent = 0.1;
  double contrast_high_percent = 99.9;
  bool rectify = true;

  template <class Visitor>
  void describe(Visitor& v) {
    v.field("debayer", debayer, "colours out of Bayer mosaics", {"bilinear", "edge_aware"});
    v.field("contrast", contrast, "stretch the gray levels, the same way for both eyes");
    v.field("contrast_low_percent", contrast_low_percent, "share of pixels that may become black", between(0, 50));
    v.field("contrast_high_percent", contrast_high_percent, "share of pixels below white", between(50, 100));
    v.field("rectify", rectify, "false: the images are rectified already, whatever the rig says");
  }
};

/// Turns shots into rectified pairs. Holds one lookup table per eye and its image buffers; has no memory from
/// frame to frame.
class Imager {
 public:
  /// Code `configuration` where a pair cannot be rectified (eyes that look apart, no common view) or a self-mask
  /// cannot be read. `mask_folder`: the rig file's folder, which the names of self-masks are relative to.
  static Result<Imager> create(const Rig& rig, const ImagingOptions& options, Workers workers,
                               const std::string& mask_folder = {});
  Imager(Imager&&) noexcept;
  Imager& operator=(Imager&&) noexcept;
  ~Imager();

  /// The views in the result are valid until the next call for the same pair. Code `input` where the frame's pair
  /// is unknown or its images have another size or format than the rig says.
  Result<RectifiedPair> process(const StereoFrame& frame);

  /// Geometry of a pair's rectified view. Throws on an unknown name.
  RectifiedStereo geometry(const std::string& pair) const;

 private:
  struct State;
  explicit Imager(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace spartan
