// The report's sections on images and disparities of the run.
#pragma once

#include <string>
#include <vector>

#include "spartan/camera/recording.h"
#include "spartan/core/result.h"
#include "spartan/imaging/imager.h"
#include "spartan/system/run_store.h"

namespace spartan::internal {

/// Left images of the odometry pairs along the drive.
Result<std::string> image_section(Recording& source, Imager& imager);

/// Rectified left images with the disparities that the run wrote into terrain/; empty where it wrote none.
Result<std::string> terrain_section(Recording& source, Imager& imager, const std::string& run, RunStore& store);

}  // namespace spartan::internal
