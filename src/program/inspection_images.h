// The images with which `rig inspect` checks a calibration.
#pragma once

#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"

namespace spartan::program {

/// One stereo frame, 8-bit gray, unrectified.
struct ImagePair {
  std::string name;  ///< the left file, or "frame 17"
  Image<std::uint8_t> left, right;
};

/// `left` and `right` each name an image, a folder, or files by a pattern ("left*.jpg"); files are paired in the order
/// of their names. At most `most` pairs, spread evenly. Code `input` if there are none, or numbers or sizes differ.
Result<std::vector<ImagePair>> load_images(const std::string& left, const std::string& right, int most);

/// The same for cameras that are not 8-bit gray (Bayer mosaic, more bits): the images pass through imaging without
/// rectification, as those of a recording do.
Result<std::vector<ImagePair>> load_images_of(const Camera& left_camera, const Camera& right_camera,
                                              const std::string& left, const std::string& right, int most,
                                              const ThreadPool& workers);

/// Frames of one pair of a recording, spread evenly; unreadable ones are skipped. Code `input` if none can be read.
Result<std::vector<ImagePair>> load_frames(Recording& source, const std::string& pair, int most,
                                           const ThreadPool& workers);

}  // namespace spartan::program
