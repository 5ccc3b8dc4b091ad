// What the images of a recording say about its calibration, for a run that was lost.
#pragma once

#include <string>

#include "spartan/camera/recording.h"
#include "spartan/core/threads.h"

namespace spartan::program {

/// Checks the odometry pair with some frames of the recording. One sentence for each finding that makes ranges or rows
/// wrong (cameras exchanged, rows that differ, wrong calibration), and the command that tells more. Empty where the
/// calibration is good or the recording cannot be read.
std::string calibration_advice(const std::string& recording, const OpenOptions& open, const std::string& odometry_pair,
                               const ThreadPool& workers);

}  // namespace spartan::program
