// The messages that a run publishes as JSON lines (docs/reference/json.md#messages-of-a-run).
#pragma once

#include <string>

#include "spartan/localization/localizer.h"
#include "spartan/system/pipeline.h"
#include "spartan/system/run.h"
#include "spartan/system/run_store.h"

namespace spartan::program {

/// `type` "pose": the localization at its newest sample.
std::string pose_message(const LocalizationEstimate& estimate);
/// `type` "health": the odometry and the sensors at a frame.
std::string health_message(const FrameRecord& frame);
/// `type` "map": the map of a stop or keyframe that was applied; `file` is null where its files could not be written.
std::string map_message(const MappedStop& stop, bool has_files);
/// `type` "panorama": one begins or has ended.
std::string panorama_message(const PanoramaEvent& event);

}  // namespace spartan::program
