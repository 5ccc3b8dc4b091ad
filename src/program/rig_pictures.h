// The pictures that `rig inspect` judges a calibration by.
#pragma once

#include <string>
#include <vector>

#include "spartan/camera/frame_source.h"
#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"
#include "spartan/rig/rig.h"

namespace spartan::program {

/// What both eyes saw at one moment, 8-bit gray, as taken.
struct PicturePair {
  std::string name;  ///< the left file, or "frame 17"
  Image<std::uint8_t> left, right;
};

/// `left` and `right` name a picture each, or a folder, or files by a pattern ("left*.jpg"), which are then paired in
/// the order of their names. At most `most` pairs, spread over all of them. Code `input` where there are none, where
/// their numbers differ, or where sizes do.
Result<std::vector<PicturePair>> load_pictures(const std::string& left, const std::string& right, int most);

/// The same pictures where the cameras' samples mean something else than gray of 8 bits: a mosaic, deep samples.
/// Through imaging without rectification, as a recording's are.
Result<std::vector<PicturePair>> load_pictures_of(const Camera& left_camera, const Camera& right_camera,
                                                  const std::string& left, const std::string& right, int most,
                                                  const Workers& workers);

/// Shots of one pair of a recording, spread over it; those that cannot be read are left out. Code `input` without any.
Result<std::vector<PicturePair>> load_shots(FrameSource& source, const std::string& pair, int most,
                                            const Workers& workers);

}  // namespace spartan::program
