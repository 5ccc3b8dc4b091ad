// Stereo frames from the image files of two cameras, for layouts without a table of frames.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "spartan/camera/internal/recording_index.h"

namespace spartan::internal {

struct FrameList {
  std::vector<FrameEntry> frames;
  std::string times;                  ///< where the stamps come from, e.g. "times in seconds from times.txt"
  std::vector<std::string> warnings;  ///< e.g. that stamps are assumed
};

/// Pairs the images of two cameras (by list_images()) and finds their stamps, in this order: in `options.times_file` or
/// `times_file` (empty: none), by `options.fps`, in the names (then images within the tolerance are pairs); else frames
/// are assumed to be 0.1 s apart, with a warning. Images with the same number in their names are pairs; without
/// numbers, those of the same rank. A row of a list of times names its images, or belongs to the frame of that rank.
/// Code `input`: no images, as many names of one camera as of the other are needed and are not there, too few times.
Result<FrameList> list_frames(const std::map<std::string, std::string>& left,
                              const std::map<std::string, std::string>& right, const std::string& pair,
                              const std::string& times_file, const OpenOptions& options);

}  // namespace spartan::internal
