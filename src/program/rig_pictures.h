// The pictures that `rig inspect` judges a calibration by.
#pragma once

#include <string>
#include <vector>

#include "spartan/camera/frame_source.h"
#include "spartan/core/image.h"
#include "spartan/core/result.h"
#include "spartan/core/threads.h"

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

/// Shots of one pair of a recording, spread over it; those that cannot be read are left out. Code `input` without any.
Result<std::vector<PicturePair>> load_shots(FrameSource& source, const std::string& pair, int most,
                                            const Workers& workers);

}  // namespace spartan::program
