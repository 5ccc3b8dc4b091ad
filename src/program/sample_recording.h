// A small recording in the layout of KITTI, cut from another recording.
#pragma once

#include <string>

#include "spartan/core/result.h"
#include "spartan/core/threads.h"

namespace spartan::program {

/// Writes the first `frames` frames of the odometry pair, rectified, into a new folder: image_0, image_1, calib.txt,
/// times.txt and, if the recording has a truth, poses.txt. Codes: those of open_recording(), `output`.
Status write_kitti_sample(const std::string& recording, int frames, const ThreadPool& workers,
                          const std::string& folder);

}  // namespace spartan::program
